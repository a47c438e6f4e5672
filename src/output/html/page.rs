//! The frame of a page: one file that needs nothing beside it.

use std::io::{self, Write};

use super::template;
use super::text::escape;

const FRAME: &str = include_str!("page.html");
const STYLE: &str = include_str!("style.css");

/// What a page is.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// Its title, as plain text.
    pub title: &'a str,
    /// What it came from, beside the tool's name, as plain text.
    pub kicker: &'a str,
    /// Its style beyond the common one.
    pub style: &'a str,
    /// True when it has scripts.
    pub scripts: bool,
}

/// Writes a page; `body` writes what stands below the kicker.
pub fn write<W: Write>(
    page: &Page,
    out: &mut W,
    body: impl FnOnce(&mut W) -> io::Result<()>,
) -> io::Result<()> {
    let mut body = Some(body);
    template::write(FRAME, out, |slot, out| {
        let text = match slot {
            "version" => env!("CARGO_PKG_VERSION").to_owned(),
            "title" => escape(page.title),
            "kicker" => escape(page.kicker),
            "style" => format!("{STYLE}{}", page.style),
            "scripts" if page.scripts => "; script-src 'unsafe-inline'".to_owned(),
            "body" => return body.take().map_or(Ok(()), |body| body(out)),
            _ => String::new(),
        };
        out.write_all(text.as_bytes())
    })
}
