//! Which of the scenes there are, are wanted.

use std::path::Path;

use super::DatasetError;

/// Names listed when the wanted one is not there.
const MOST: usize = 20;

/// Indices of the scenes that `wanted` names, in the order of `names`. A name is
/// that of a scene (`000027`, also without its leading zeros), or some of its
/// leading or trailing parts: `clean` and `alley_1` both mean `clean/alley_1`.
///
/// # Errors
/// When there is no such scene.
pub fn matching(path: &Path, names: &[String], wanted: &str) -> Result<Vec<usize>, DatasetError> {
    let found: Vec<usize> =
        (0..names.len()).filter(|&index| matches(&names[index], wanted)).collect();
    if found.is_empty() {
        return Err(DatasetError::NoScene {
            path: path.to_owned(),
            scene: wanted.to_owned(),
            available: some_of(names),
        });
    }
    Ok(found)
}

fn matches(name: &str, wanted: &str) -> bool {
    let wanted = wanted.trim_matches('/');
    let number = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| text.trim_start_matches('0').to_owned())
    };
    let same_number = number(name).is_some_and(|n| number(wanted) == Some(n));
    let begins = name.strip_prefix(wanted).is_some_and(|rest| rest.starts_with('/'));
    let ends = name.strip_suffix(wanted).is_some_and(|rest| rest.ends_with('/'));
    name == wanted || same_number || begins || ends
}

fn some_of(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST);
    let text = names.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}
