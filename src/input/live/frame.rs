//! Decodes a pair and puts it together with its calibration.

use std::sync::Arc;

use thiserror::Error;

use super::{ImageMessage, LivePair};
use crate::camera::StereoRig;
use crate::error::CalibrationError;
use crate::image::{Picture, Size};
use crate::perception::StereoFrame;
use crate::ros::convert::{
    ConvertError, common_size, compressed_picture, picture, rig, split_side_by_side,
};
use crate::ros::message::sensor_msgs::CameraInfo;
use crate::ros::message::std_msgs::Header;

/// A pair that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FrameError {
    /// An image cannot be decoded.
    #[error("{side} image: {source}")]
    Image {
        /// `left`, `right` or `side-by-side`.
        side: &'static str,
        /// Why.
        source: ConvertError,
    },
    /// The two images do not fit together.
    #[error(transparent)]
    Pair(ConvertError),
    /// There is no usable calibration.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Makes frames of pairs. The rig is made anew only when a camera info, the
/// size or the baseline changes.
#[derive(Debug, Default)]
pub struct FrameBuilder {
    rig: Option<KnownRig>,
    frame_id: Option<Arc<str>>,
    frame_ids_differ: bool,
}

#[derive(Debug)]
struct KnownRig {
    infos: [Arc<CameraInfo>; 2],
    size: Size,
    baseline_override: f64,
    made: Result<Arc<StereoRig>, CalibrationError>,
}

impl FrameBuilder {
    /// The frame of `pair`.
    ///
    /// # Errors
    /// When an image cannot be decoded, the sizes differ or the calibration is
    /// of no use.
    pub fn frame(
        &mut self,
        pair: &LivePair,
        baseline_override: f64,
    ) -> Result<StereoFrame, FrameError> {
        let (left, right) = if let Some(right) = &pair.right {
            (decode("left", &pair.left)?, decode("right", right)?)
        } else {
            let both = decode("side-by-side", &pair.left)?;
            split_side_by_side(&both)
                .map_err(|source| FrameError::Image { side: "side-by-side", source })?
        };
        let size = common_size(&left, &right).map_err(FrameError::Pair)?;
        let rig = self.rig([&pair.left_info, &pair.right_info], size, baseline_override)?;
        Ok(StereoFrame {
            stamp: pair.stamp,
            right_stamp: pair.right_stamp,
            frame_id: self.frame_id(pair),
            left,
            right,
            rig,
        })
    }

    fn rig(
        &mut self,
        infos: [&Arc<CameraInfo>; 2],
        size: Size,
        baseline_override: f64,
    ) -> Result<Arc<StereoRig>, CalibrationError> {
        let known = self.rig.take().filter(|known| {
            known.size == size
                && known.baseline_override == baseline_override
                && known.infos.iter().zip(infos).all(|(known, info)| Arc::ptr_eq(known, info))
        });
        let known = known.unwrap_or_else(|| KnownRig {
            infos: infos.map(Arc::clone),
            size,
            baseline_override,
            made: rig(infos[0], infos[1], size, baseline_override).map(Arc::new),
        });
        let made = known.made.clone();
        self.rig = Some(known);
        made
    }

    fn frame_id(&mut self, pair: &LivePair) -> Arc<str> {
        let left = &header(&pair.left).frame_id;
        if let Some(right) = pair.right.as_ref().map(|right| &header(right).frame_id)
            && left != right
            && !std::mem::replace(&mut self.frame_ids_differ, true)
        {
            tracing::warn!(
                "left images have frame_id '{}', right ones '{}': the left one is used",
                left.escape_debug(),
                right.escape_debug()
            );
        }
        match &self.frame_id {
            Some(known) if **known == **left => Arc::clone(known),
            _ => {
                let id: Arc<str> = Arc::from(left.as_str());
                self.frame_id = Some(Arc::clone(&id));
                id
            }
        }
    }
}

fn header(image: &ImageMessage) -> &Header {
    match image {
        ImageMessage::Raw(image) => &image.header,
        ImageMessage::Compressed(image) => &image.header,
    }
}

fn decode(side: &'static str, image: &ImageMessage) -> Result<Picture, FrameError> {
    match image {
        ImageMessage::Raw(image) => picture(image),
        ImageMessage::Compressed(image) => compressed_picture(image),
    }
    .map_err(|source| FrameError::Image { side, source })
}
