//! Attention maps as files, for referees outside.

use std::fs;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::store::file_name;
use crate::image::Image;
use crate::output::picture::{PictureError, png_gray};

/// Why a map could not be written.
#[derive(Debug, Error)]
pub enum MapError {
    /// The system refuses.
    #[error("cannot write the map {path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: std::io::Error,
    },
    /// It cannot be encoded.
    #[error("the map {path}: {source}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        source: PictureError,
    },
}

/// A folder of maps: `DATASET/METHOD/[SCENE/]IMAGE.png`, 8-bit gray, 255 most
/// salient, as they are. Stills have no folder of their own.
#[derive(Clone, Debug)]
pub struct MapFolder {
    folder: PathBuf,
}

impl MapFolder {
    /// Maps go below `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// Writes the map of one image.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(
        &self,
        dataset: &str,
        method: &str,
        scene: Option<&str>,
        image: &str,
        map: &Image<u8>,
    ) -> Result<(), MapError> {
        let mut folder = self.folder.join(file_name(dataset)).join(file_name(method));
        if let Some(scene) = scene {
            folder.push(file_name(scene));
        }
        let path = folder.join(format!("{}.png", file_name(image)));
        let io = |source| MapError::Io { path: path.clone(), source };
        fs::create_dir_all(&folder).map_err(io)?;
        let bytes =
            png_gray(map).map_err(|source| MapError::Encode { path: path.clone(), source })?;
        fs::write(&path, bytes).map_err(io)
    }
}
