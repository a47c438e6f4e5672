//! Texts with slots, `{{name}}`.

use std::io::{self, Write};

/// Writes `template`; `fill` writes what stands at each slot. What it writes
/// is not looked through for slots.
pub fn write<W: Write>(
    template: &str,
    out: &mut W,
    mut fill: impl FnMut(&str, &mut W) -> io::Result<()>,
) -> io::Result<()> {
    let mut rest = template;
    while let Some((before, name, after)) = next_slot(rest) {
        out.write_all(before.as_bytes())?;
        fill(name, out)?;
        rest = after;
    }
    out.write_all(rest.as_bytes())
}

/// The text before the next `{{name}}`, the name, and the text after it.
fn next_slot(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once("{{")?;
    let (name, after) = rest.split_once("}}")?;
    Some((before, name, after))
}
