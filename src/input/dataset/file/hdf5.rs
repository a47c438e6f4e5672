//! Arrays of floats in HDF5 files, as Spring has them: `.dsp5` holds `disparity`
//! (rows, columns), `.flo5` holds `flow` (rows, columns, 2), both compressed.

use std::path::Path;

use hdf5_reader::{Hdf5File, OpenOptions};

use super::super::DatasetError;
use super::{MAX_SIDE, bytes, fault, no_pixels};
use crate::image::{Image, Size};

/// Most bytes of an array, and of one of its compressed chunks. Spring has 66 MB.
const MAX_ARRAY: usize = 1 << 28;

/// Every second pixel of every second row of the array `name`, whose shape is
/// (rows, columns) or (rows, columns, `N`); what is not finite is unknown (NaN).
///
/// # Errors
/// When the file is no HDF5 file, has no such array of that shape, or a larger one.
pub fn every_second<const N: usize>(
    path: &Path,
    name: &str,
) -> Result<Image<[f32; N]>, DatasetError>
where
    [f32; N]: Default,
{
    let failed = |e: hdf5_reader::error::Error| fault(path, &e.to_string());
    let options =
        OpenOptions::default().with_max_chunk_bytes(MAX_ARRAY).with_max_read_bytes(MAX_ARRAY);
    let file = Hdf5File::from_vec_with_options(bytes(path)?, options).map_err(failed)?;
    let array = file.dataset(name).map_err(failed)?;
    let (rows, columns, channels) = match *array.shape() {
        [rows, columns] => (rows, columns, 1),
        [rows, columns, channels] => (rows, columns, channels),
        _ => (0, 0, 0),
    };
    let side = 1..=u64::from(MAX_SIDE);
    if channels != N as u64 || !side.contains(&rows) || !side.contains(&columns) {
        let found = array.shape();
        return Err(fault(
            path,
            &format!("'{name}' has the shape {found:?}, not rows and columns of {N}"),
        ));
    }
    let values = array.read_array::<f32>().map_err(failed)?;
    let values: Vec<f32> = values.into_iter().collect();
    let (pixels, _) = values.as_chunks::<N>();
    let columns = columns as usize;
    let size = Size::new(columns.div_ceil(2), (rows as usize).div_ceil(2));
    let known = |pixel: [f32; N]| pixel.map(|v| if v.is_finite() { v } else { f32::NAN });
    let kept = pixels.chunks_exact(columns).step_by(2).flat_map(|row| row.iter().step_by(2));
    Image::from_vec(size, kept.map(|pixel| known(*pixel)).collect()).ok_or_else(|| no_pixels(path))
}
