//! From the path of a bag to its files, in their order.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::error::BagError;

const METADATA: &str = "metadata.yaml";

/// A metadata file is a few kilobytes; ten thousand splits make a megabyte.
const MAX_METADATA_BYTES: u64 = 16 << 20;

#[derive(Deserialize)]
struct Document {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    storage_identifier: String,
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
}

/// The files of the bag at `path` and what was noticed on the way.
///
/// # Errors
/// When there is no bag, or one that cannot be read here.
pub fn files(path: &Path) -> Result<(Vec<PathBuf>, Vec<String>), BagError> {
    let unreadable = |source| BagError::Io { path: path.to_owned(), source };
    if !fs::metadata(path).map_err(unreadable)?.is_dir() {
        return if has_extension(path, "db3") {
            Err(BagError::Sqlite { path: path.to_owned() })
        } else {
            Ok((vec![path.to_owned()], Vec::new()))
        };
    }
    match fs::metadata(path.join(METADATA)) {
        Ok(metadata) => Ok((listed(path, metadata.len())?, Vec::new())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let files = found(path)?;
            let note = format!(
                "{} has no {METADATA} (the recorder did not finish): its {} .mcap files are taken in the order of their numbers",
                path.display(),
                files.len()
            );
            Ok((files, vec![note]))
        }
        Err(source) => Err(unreadable(source)),
    }
}

/// The files that `metadata.yaml` lists.
fn listed(folder: &Path, metadata_len: u64) -> Result<Vec<PathBuf>, BagError> {
    let path = folder.join(METADATA);
    let wrong = |reason: String| BagError::Metadata { path: path.clone(), reason };
    if metadata_len > MAX_METADATA_BYTES {
        return Err(wrong(format!("{metadata_len} bytes are too many for a bag's metadata")));
    }
    let unreadable = |source| BagError::Io { path: path.clone(), source };
    let text = fs::read_to_string(&path).map_err(unreadable)?;
    let Document { rosbag2_bagfile_information: bag } =
        serde_saphyr::from_str(&text).map_err(|e| wrong(format!("not a bag's metadata: {e}")))?;
    if bag.storage_identifier == "sqlite3" {
        return Err(BagError::Sqlite { path: folder.to_owned() });
    }
    if !matches!(bag.storage_identifier.as_str(), "" | "mcap") {
        return Err(wrong(format!(
            "storage '{}' is not read here, only mcap: convert the bag with `ros2 bag convert`",
            bag.storage_identifier
        )));
    }
    let mode = bag.compression_mode.to_ascii_lowercase();
    if !matches!(mode.as_str(), "" | "none" | "storage") {
        return Err(BagError::Compressed {
            path: folder.to_owned(),
            format: bag.compression_format,
            mode,
        });
    }
    if bag.relative_file_paths.is_empty() {
        return Err(wrong("relative_file_paths is empty".to_owned()));
    }
    let real_folder =
        folder.canonicalize().map_err(|source| BagError::Io { path: folder.to_owned(), source })?;
    let inside = |named: &String| {
        let outside = || BagError::Outside { path: path.clone(), named: named.clone() };
        let relative = Path::new(named);
        let plain = relative
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !plain || named.is_empty() {
            return Err(outside());
        }
        let file = folder.join(relative);
        // A link inside the folder may lead out of it.
        match file.canonicalize() {
            Ok(real) if real.starts_with(&real_folder) => Ok(file),
            Ok(_) => Err(outside()),
            Err(source) => Err(BagError::Io { path: file, source }),
        }
    };
    bag.relative_file_paths.iter().map(inside).collect()
}

/// The `.mcap` files of a folder without metadata, `_2` before `_10`.
fn found(folder: &Path) -> Result<Vec<PathBuf>, BagError> {
    let unreadable = |source| BagError::Io { path: folder.to_owned(), source };
    let mut files = Vec::new();
    let mut sqlite = false;
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        sqlite |= has_extension(&path, "db3");
        if has_extension(&path, "mcap") {
            files.push(path);
        }
    }
    if files.is_empty() {
        let path = folder.to_owned();
        return Err(if sqlite { BagError::Sqlite { path } } else { BagError::NoFiles { path } });
    }
    files.sort_by_cached_key(|path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (name, number) = stem.split_at(stem.len() - digits);
        // Longer numbers are larger, as far as they have no leading zeros.
        let number = number.trim_start_matches('0');
        (name.to_owned(), number.len(), number.to_owned())
    });
    Ok(files)
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}
