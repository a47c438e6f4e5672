//! Parts on disk: what is measured once is not measured again.
//!
//! ```text
//! FOLDER/DATASET/SCENE/METHOD.json        one part
//! FOLDER/DATASET/SCENE/METHOD-ROLE.jpg    its pictures
//! ```
//! Folders of several runs, of shards on other machines for example, are read
//! together by [`Store::parts`].

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use thiserror::Error;

use super::part::{Part, Run};

/// Largest file of a part.
const MOST_BYTES: u64 = 64 << 20;
/// Folders below which parts are looked for.
const MOST_DEPTH: usize = 3;

/// Why parts could not be kept or read.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The system refuses.
    #[error("cannot {verb} {path}: {source}")]
    Io {
        /// What was tried.
        verb: &'static str,
        /// File or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// A file that is no part.
    #[error("{path} is no part of an evaluation: {source}")]
    Part {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// A file that is too large for a part.
    #[error("{path} has {bytes} bytes, {MOST_BYTES} is the most a part of an evaluation has")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// No part anywhere.
    #[error("{path} holds no part of an evaluation (DATASET/SCENE/METHOD.json)")]
    Empty {
        /// The folder.
        path: PathBuf,
    },
}

/// A folder of parts.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// A picture of a part that is not yet written: its role and JPEG bytes.
pub type Picture = (&'static str, Vec<u8>);

impl Store {
    /// The parts in `folder`, which is made when the first one is kept.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The part of a scene by a method, if it was measured under the same
    /// circumstances.
    ///
    /// # Errors
    /// When there is a file and it cannot be read.
    pub fn find(
        &self,
        dataset: &str,
        scene: &str,
        method: &str,
        run: &Run,
    ) -> Result<Option<Part>, StoreError> {
        let path = self.path(dataset, scene, method);
        if !path.is_file() {
            return Ok(None);
        }
        // A part of another version may lack fields; it is measured again.
        let part = read(&path).ok().filter(|part| part.run.repeats(run));
        Ok(part.map(|part| self.resolve(part)))
    }

    /// Writes a part and its pictures. The part comes last, by renaming: when
    /// it is there it is whole. Answers with the part that knows its pictures.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn keep(&self, mut part: Part, pictures: &[Picture]) -> Result<Part, StoreError> {
        let path = self.path(&part.dataset, &part.scene, &part.method);
        let folder = path.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(|e| io_error("make", folder, e))?;
        for (role, jpeg) in pictures {
            let file = folder.join(format!("{}-{role}.jpg", file_name(&part.method)));
            fs::write(&file, jpeg).map_err(|e| io_error("write", &file, e))?;
            let inside = file.strip_prefix(&self.folder).unwrap_or(&file).display().to_string();
            for shot in part.gallery.iter_mut().filter(|shot| shot.role == *role) {
                shot.file.clone_from(&inside);
            }
        }
        let text = serde_json::to_vec(&part)
            .map_err(|source| StoreError::Part { path: path.clone(), source })?;
        let unfinished = path.with_extension("json.part");
        fs::write(&unfinished, text).map_err(|e| io_error("write", &unfinished, e))?;
        fs::rename(&unfinished, &path).map_err(|e| io_error("write", &path, e))?;
        Ok(self.resolve(part))
    }

    /// All parts in the folder, in the order of their paths.
    ///
    /// # Errors
    /// When a file cannot be read or there is none.
    pub fn parts(&self) -> Result<Vec<Part>, StoreError> {
        let mut files = Vec::new();
        list(&self.folder, MOST_DEPTH, &mut files)?;
        files.sort();
        let mut parts = Vec::with_capacity(files.len());
        for file in &files {
            parts.push(self.resolve(read(file)?));
        }
        if parts.is_empty() {
            return Err(StoreError::Empty { path: self.folder.clone() });
        }
        Ok(parts)
    }

    /// Puts the folder in front of the files of the pictures. Parts may be
    /// anybody's: pictures that lead out of the folder are dropped.
    fn resolve(&self, mut part: Part) -> Part {
        let is_inside = |file: &str| {
            !file.is_empty()
                && Path::new(file).components().all(|part| matches!(part, Component::Normal(_)))
        };
        part.gallery.retain(|shot| is_inside(&shot.file));
        for shot in &mut part.gallery {
            shot.file = self.folder.join(&shot.file).display().to_string();
        }
        part
    }

    fn path(&self, dataset: &str, scene: &str, method: &str) -> PathBuf {
        let mut path = self.folder.join(file_name(dataset)).join(file_name(scene));
        path.push(format!("{}.json", file_name(method)));
        path
    }
}

/// A name without what file systems or shells take for something else.
pub fn file_name(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.chars().map(|c| if plain(c) { c } else { '_' }).collect();
    // No name that means a folder.
    if name.trim_matches('.').is_empty() { format!("_{name}") } else { name }
}

fn list(folder: &Path, depth: usize, out: &mut Vec<PathBuf>) -> Result<(), StoreError> {
    let failed = |e| io_error("read", folder, e);
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() {
            if depth > 1 {
                list(&path, depth - 1, out)?;
            }
        } else if depth == 1 && path.extension().is_some_and(|e| e == "json") {
            out.push(path);
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Part, StoreError> {
    let failed = |e| io_error("read", path, e);
    let bytes = fs::metadata(path).map_err(failed)?.len();
    if bytes > MOST_BYTES {
        return Err(StoreError::TooLarge { path: path.to_owned(), bytes });
    }
    let text = fs::read(path).map_err(failed)?;
    serde_json::from_slice(&text)
        .map_err(|source| StoreError::Part { path: path.to_owned(), source })
}

fn io_error(verb: &'static str, path: &Path, source: io::Error) -> StoreError {
    StoreError::Io { verb, path: path.to_owned(), source }
}
