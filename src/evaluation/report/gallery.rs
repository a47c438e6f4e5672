//! Best and worst frames as pictures inside the page.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::evaluation::group::{Group, label};
use crate::evaluation::{Evaluation, Part, Shot};
use crate::output::html::text::escape;

/// Most bytes of one picture.
const MAX_PICTURE_BYTES: u64 = 4 << 20;

/// Most bytes of all pictures of a page; in the file they are a third larger.
const MAX_BYTES: u64 = 24 << 20;

/// Most pictures per method, measure and role.
const MAX_SHOTS: usize = 2;

/// What begins a JPEG.
const JPEG: [u8; 3] = [0xff, 0xd8, 0xff];

/// True when there is any picture.
pub fn has_any(group: &Group) -> bool {
    group.compared().iter().any(|merged| !merged.total.gallery.is_empty())
}

/// Reads pictures until the page has enough of them.
pub struct Gallery {
    left: u64,
}

impl Default for Gallery {
    fn default() -> Self {
        Self { left: MAX_BYTES }
    }
}

impl Gallery {
    /// The best and worst frames of every method of a data set.
    pub fn html(&mut self, evaluation: &Evaluation, group: &Group) -> String {
        let mut out = String::new();
        for merged in group.compared() {
            let parts = evaluation.parts.iter();
            let parts = parts.filter(|p| p.dataset == group.dataset && p.method == merged.method);
            let mut by_measure: BTreeMap<&str, Vec<(&Part, &Shot)>> = BTreeMap::new();
            for (part, shot) in parts.flat_map(|part| part.gallery.iter().map(move |s| (part, s))) {
                by_measure.entry(&shot.measure).or_default().push((part, shot));
            }
            for (measure, shots) in by_measure {
                let figures: String =
                    select(shots).into_iter().map(|(part, shot)| self.figure(part, shot)).collect();
                out += &format!(
                    "<h3>{}, by {}</h3><div class=\"shots\">{figures}</div>",
                    escape(label(&merged.method)),
                    escape(measure)
                );
            }
        }
        out
    }

    fn figure(&mut self, part: &Part, shot: &Shot) -> String {
        let picture = match self.read(&shot.file) {
            Ok(bytes) => {
                format!("<img alt=\"\" src=\"data:image/jpeg;base64,{}\">", BASE64.encode(bytes))
            }
            Err(reason) => format!("<div class=\"gone\">{}</div>", escape(&reason)),
        };
        let class = if shot.role == "worst" { "worst" } else { "best" };
        format!(
            "<figure class=\"{class}\">{picture}<figcaption><b>{}</b> · {}, frame {} · {} {:.3}</figcaption></figure>",
            escape(&shot.role),
            escape(&part.scene),
            shot.frame,
            escape(&shot.measure),
            shot.value
        )
    }

    /// The picture, or why it is not there.
    fn read(&mut self, path: &str) -> Result<Vec<u8>, String> {
        let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy();
        let most = MAX_PICTURE_BYTES.min(self.left);
        if most == 0 {
            return Err("left out: the page has pictures enough".into());
        }
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(most + 1).read_to_end(&mut bytes))
            .map_err(|error| format!("{name}: {error}"))?;
        let size = bytes.len() as u64;
        if size > most {
            return Err(format!("{name} is larger than the {most} bytes that are left for it"));
        }
        if !bytes.starts_with(&JPEG) {
            return Err(format!("{name} is no JPEG"));
        }
        self.left -= size;
        Ok(bytes)
    }
}

/// The best of the best and the worst of the worst.
fn select<'a>(shots: Vec<(&'a Part, &'a Shot)>) -> Vec<(&'a Part, &'a Shot)> {
    let (mut worst, mut best): (Vec<_>, Vec<_>) =
        shots.into_iter().partition(|(_, shot)| shot.role == "worst");
    let mean = |shots: &[(&Part, &Shot)]| {
        shots.iter().map(|(_, shot)| shot.value).sum::<f64>() / shots.len() as f64
    };
    // Of errors less is better, of overlaps more: the shots themselves tell.
    let more_is_better = mean(&best) > mean(&worst);
    let by_value = |a: &(&Part, &Shot), b: &(&Part, &Shot)| a.1.value.total_cmp(&b.1.value);
    best.sort_by(by_value);
    worst.sort_by(by_value);
    if more_is_better {
        best.reverse();
    } else {
        worst.reverse();
    }
    best.truncate(MAX_SHOTS);
    worst.truncate(MAX_SHOTS);
    best.into_iter().chain(worst).collect()
}
