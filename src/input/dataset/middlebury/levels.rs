//! How many gray levels a pixel of disparity has in maps of 8 bits.

use std::path::Path;

use super::super::DatasetError;
use super::super::file::dimensions;
use super::super::folder::{optional, text};

/// Full size of the two sets of 2003 (cones and teddy).
const FULL_2003: u32 = 1800;
/// Size of tsukuba, which has its own scale.
const TSUKUBA: (u32, u32) = (384, 288);

/// Scale of the maps of 2005 and 2006, which is what the images were divided by:
/// full size is 1240 to 1396 pixels wide, half and third follow.
pub fn of_structured_light(left: &Path) -> Result<(u8, String), DatasetError> {
    let (width, _) = dimensions(left)?;
    let (factor, name) = match width {
        900.. => (1, "full"),
        550..900 => (2, "half"),
        _ => (3, "third"),
    };
    Ok((factor, format!("disparity is value / {factor}: {width} pixels of width are {name} size")))
}

/// Scale of the maps up to 2003: the first number of `info.txt`, else as published.
pub fn of_early(folder: &Path, left: &Path) -> Result<(f32, String), DatasetError> {
    if let Some(path) = optional(folder.join("info.txt")) {
        let text = text(&path)?;
        let first = text.split_whitespace().next().unwrap_or_default();
        let levels = first.parse::<f32>().ok().filter(|v| v.is_finite() && *v > 0.0);
        return match levels {
            Some(levels) => Ok((levels, format!("disparity is value / {levels}, from info.txt"))),
            None => Err(DatasetError::Text {
                path,
                fault: format!(
                    "it starts with '{first}', the gray levels per pixel of disparity are needed"
                ),
            }),
        };
    }
    let size = dimensions(left)?;
    let (levels, of) = match size {
        TSUKUBA => (16, "tsukuba"),
        (FULL_2003, _) => (1, "full size of 2003"),
        (900, 750) => (2, "half size of 2003"),
        (450, 375) => (4, "quarter size of 2003"),
        _ => (8, "the sets of 2001"),
    };
    let (width, height) = size;
    let note = format!(
        "disparity is value / {levels}, as published for {of} ({width}x{height}); there is no info.txt"
    );
    Ok((levels as f32, note))
}
