//! What pages are made of: text, plots, the common style.

#![allow(
    clippy::format_push_string,
    clippy::format_collect,
    reason = "a page is put together once per run: that it can be read counts, not an allocation"
)]

pub mod page;
pub mod plot;
pub mod template;
pub mod text;
