//! What is in the folders of a data set, always in the order of the names.

use std::fs;
use std::path::{Path, PathBuf};

use super::DatasetError;

/// Names of the folders in a folder, without hidden ones.
pub fn folders(path: &Path) -> Result<Vec<String>, DatasetError> {
    names(path, Path::is_dir)
}

/// Names of the files in a folder, without hidden ones.
pub fn files(path: &Path) -> Result<Vec<String>, DatasetError> {
    names(path, Path::is_file)
}

/// The files `PREFIX` digits `SUFFIX` of a folder with their numbers.
pub fn numbered(
    path: &Path,
    prefix: &str,
    suffix: &str,
) -> Result<Vec<(u32, String)>, DatasetError> {
    let mut found: Vec<(u32, String)> = files(path)?
        .into_iter()
        .filter_map(|name| {
            let digits = name.strip_prefix(prefix)?.strip_suffix(suffix)?;
            let plain = digits.bytes().all(|b| b.is_ascii_digit());
            let number = plain.then(|| digits.parse().ok()).flatten()?;
            Some((number, name))
        })
        .collect();
    found.sort_unstable();
    if found.is_empty() {
        let path = path.join(format!("{prefix}0001{suffix}"));
        return Err(missing(&path, "the folder holds no image of that naming"));
    }
    Ok(found)
}

/// The first of `candidates` that is a folder.
pub fn first_folder(candidates: &[PathBuf]) -> Option<PathBuf> {
    candidates.iter().find(|path| path.is_dir()).cloned()
}

/// The file, when it is there.
pub fn optional(path: PathBuf) -> Option<PathBuf> {
    path.is_file().then_some(path)
}

/// Refuses when the file is not there.
pub fn present(path: &Path, needed: &str) -> Result<(), DatasetError> {
    if path.is_file() { Ok(()) } else { Err(missing(path, needed)) }
}

/// That something is not there.
pub fn missing(path: &Path, needed: &str) -> DatasetError {
    DatasetError::Missing { path: path.to_owned(), needed: needed.to_owned() }
}

/// The text of a file.
pub fn text(path: &Path) -> Result<String, DatasetError> {
    fs::read_to_string(path).map_err(|source| DatasetError::Io { path: path.to_owned(), source })
}

fn names(path: &Path, wanted: impl Fn(&Path) -> bool) -> Result<Vec<String>, DatasetError> {
    let io = |source| DatasetError::Io { path: path.to_owned(), source };
    let mut names = Vec::new();
    for entry in fs::read_dir(path).map_err(io)? {
        let entry = entry.map_err(io)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') && wanted(&entry.path()) {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}
