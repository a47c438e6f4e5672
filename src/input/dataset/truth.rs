//! The files that say what is true about a frame.

use std::path::PathBuf;

use super::DatasetError;
use super::file::{check_size, disparity, flow, mask, objects};
use crate::image::Size;
use crate::input::Truth;

/// How a file holds disparity `x_l - x_r` in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DisparityCoding {
    /// 16-bit gray PNG: value / 256, 0 unknown (KITTI).
    Fixed16,
    /// 8-bit gray image: value / `levels_per_px`, 0 unknown (Middlebury to 2006).
    Fixed8 {
        /// Gray levels per pixel of disparity.
        levels_per_px: f32,
    },
    /// PFM with one channel; infinite is unknown (Middlebury since 2014).
    Pfm,
    /// 8-bit RGB PNG: `4 R + G / 64 + B / 16384` (Sintel).
    Sintel,
    /// HDF5 at twice the resolution of the image; NaN is unknown (Spring).
    Spring,
}

/// How a file holds motion `[dx, dy]` in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlowCoding {
    /// 16-bit RGB PNG: `(value - 2^15) / 64`, unknown where blue is 0 (KITTI).
    Fixed16,
    /// `.flo`, unknown beyond 1e9 (Middlebury, Sintel).
    Flo,
    /// HDF5 at twice the resolution of the image; NaN is unknown (Spring).
    Spring,
}

/// How a file holds objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectCoding {
    /// The value of a gray pixel is the id (`obj_map` of KITTI 2015).
    Ids,
    /// The index of a palette pixel is the id, 255 belongs to none; in a gray
    /// image 255 is object 1 and any other value the id (DAVIS).
    Indexed,
    /// One object where a gray value is 128 or more.
    Mask,
}

/// How a file says which pixels of a map count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskCoding {
    /// Those that are white (255).
    White,
    /// Those whose red and green are 0.
    Black,
}

/// Which pixels of a map count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaskFile {
    /// The file.
    pub path: PathBuf,
    /// What it holds.
    pub coding: MaskCoding,
}

/// True disparity of the left image.
#[derive(Clone, Debug, PartialEq)]
pub struct DisparityFile {
    /// The file.
    pub path: PathBuf,
    /// What it holds.
    pub coding: DisparityCoding,
    /// What is left out of it.
    pub masks: Vec<MaskFile>,
}

/// True motion of the left image to the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowFile {
    /// The file.
    pub path: PathBuf,
    /// What it holds.
    pub coding: FlowCoding,
    /// What is left out of it.
    pub masks: Vec<MaskFile>,
}

/// True objects of the left image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectFile {
    /// The file.
    pub path: PathBuf,
    /// What it holds.
    pub coding: ObjectCoding,
}

/// What is known to be true about a left image, as files; see [`Truth`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TruthFiles {
    /// Disparity where both cameras see, as far as the data set can tell.
    pub disparity: Option<DisparityFile>,
    /// Disparity of all pixels, from data sets that can tell.
    pub disparity_with_occluded: Option<DisparityFile>,
    /// Objects.
    pub objects: Option<ObjectFile>,
    /// Motion.
    pub flow: Option<FlowFile>,
}

impl TruthFiles {
    /// Decodes the files for a left image of `size`; `offset` is `cx_l - cx_r`
    /// in pixels. `None` when there are no files.
    ///
    /// # Errors
    /// A file that cannot be read or has another size.
    pub(super) fn read(&self, size: Size, offset: f32) -> Result<Option<Truth>, DatasetError> {
        if *self == Self::default() {
            return Ok(None);
        }
        let disparity = |file: &DisparityFile| {
            let mut map = disparity::read(&file.path, file.coding)?;
            check_size(&file.path, map.size(), size)?;
            for mask in &file.masks {
                mask::apply(mask, &mut map, f32::NAN)?;
            }
            for d in map.pixels_mut() {
                *d -= offset;
            }
            Ok(map)
        };
        let flow = |file: &FlowFile| {
            let mut map = flow::read(&file.path, file.coding)?;
            check_size(&file.path, map.size(), size)?;
            for mask in &file.masks {
                mask::apply(mask, &mut map, [f32::NAN; 2])?;
            }
            Ok(map)
        };
        let objects = |file: &ObjectFile| {
            let map = objects::read(&file.path, file.coding)?;
            check_size(&file.path, map.size(), size)?;
            Ok(map)
        };
        Ok(Some(Truth {
            disparity: self.disparity.as_ref().map(disparity).transpose()?,
            disparity_with_occluded: self
                .disparity_with_occluded
                .as_ref()
                .map(disparity)
                .transpose()?,
            objects: self.objects.as_ref().map(objects).transpose()?,
            flow: self.flow.as_ref().map(flow).transpose()?,
        }))
    }
}
