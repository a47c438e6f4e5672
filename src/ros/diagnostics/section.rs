//! What the statuses of the `/diagnostics` message say of alignment, ground and stages.

use super::Work;
use super::draft::Draft;
use crate::metric::{Epipolar, MISALIGNED_PX};
use crate::perception::{Rejections, Stage};
use crate::ros::message::diagnostic_msgs::DiagnosticStatus;
use crate::stage::ground::Footing;

/// How the rows of the two images lie to each other.
pub(super) fn alignment(found: &Epipolar, rectify: bool, draft: &mut Draft) {
    draft.value("vertical offset of matched points (px)", format_args!("{:.2}", found.offset_px));
    draft.value("epipolar error (px)", format_args!("{:.2}", found.error_px));
    draft.value("points matched for it", found.points);
    if found.error_px > MISALIGNED_PX {
        let fix = if rectify { "" } else { ", or set rectify for raw images" };
        draft.say(
            DiagnosticStatus::WARN,
            format_args!(
                "rows of the two images are {:.1} px apart (median of {} points): calibrate the cameras anew{fix}",
                found.error_px, found.points
            ),
        );
    }
}

/// The ground plane, in words.
pub(super) fn ground(seen: Option<&Footing>) -> String {
    match seen {
        None => "not looked for".to_owned(),
        Some(Footing { state, plane: None }) => state.name().to_owned(),
        Some(Footing { state, plane: Some(plane) }) => {
            format!("{}, camera {:.2} m above it", state.name(), plane.camera_height_m)
        }
    }
}

/// Times and rejections per frame.
pub(super) fn processing(work: &Work) -> Draft {
    let mut draft = Draft::new();
    if work.frames == 0 {
        return draft;
    }
    let frames = f64::from(work.frames);
    for (stage, sum) in Stage::ALL.into_iter().zip(work.stage_ms) {
        draft.value(format!("{} (ms)", stage.name()), format_args!("{:.2}", sum / frames));
    }
    let total: f64 = work.stage_ms.iter().sum();
    draft.value("total (ms)", format_args!("{:.2}", total / frames));
    draft.value("longest frame (ms)", format_args!("{:.2}", work.longest_ms));
    draft.value("share of the image matched", format_args!("{:.3}", work.roi_fraction / frames));
    for (name, count) in Rejections::REASONS.into_iter().zip(work.rejections) {
        draft.value(format!("candidates refused: {name}"), count);
    }
    draft
}
