//! The report: one HTML file with every table, curve and picture of an
//! evaluation, which needs nothing beside it.

#![allow(
    clippy::format_push_string,
    clippy::format_collect,
    reason = "a page is put together once per run: that it can be read counts, not an allocation"
)]

mod bars;
mod curves;
mod gallery;
mod grid;

use std::collections::BTreeSet;
use std::io::{self, Write};

use super::group::{Group, Merged, OURS};
use super::{Evaluation, tables};
use crate::output::html::page::{self, Page};
use crate::output::html::template;
use crate::output::html::text::{count, escape, ms, percent};
use crate::table::Table;
use gallery::Gallery;

const BODY: &str = include_str!("report/page.html");
const STYLE: &str = include_str!("report/page.css");

/// One data set with its tables.
struct Chapter {
    group: Group,
    tables: Vec<Table>,
}

/// Writes the whole page.
///
/// # Errors
/// When it cannot be written. A picture that cannot be read is said so on the
/// page.
pub fn write<W: Write>(evaluation: &Evaluation, out: &mut W) -> io::Result<()> {
    let chapters: Vec<Chapter> = Group::all(evaluation)
        .into_iter()
        .map(|group| Chapter { tables: tables::of_group(&group), group })
        .collect();
    let page = Page {
        title: "Evaluation",
        kicker: "methods on data with truth",
        style: STYLE,
        scripts: false,
    };
    page::write(&page, out, |out| {
        template::write(BODY, out, |slot, out| match slot {
            "facts" => out.write_all(facts(&chapters).as_bytes()),
            "command" => out.write_all(escape(&evaluation.command).as_bytes()),
            "contents" => out.write_all(contents(&chapters).as_bytes()),
            "words" => out.write_all(words(&chapters).as_bytes()),
            "chapters" => {
                let mut gallery = Gallery::default();
                for (i, chapter) in chapters.iter().enumerate() {
                    write_chapter(i, chapter, evaluation, &mut gallery, out)?;
                }
                Ok(())
            }
            _ => Ok(()),
        })
    })
}

fn facts(chapters: &[Chapter]) -> String {
    if chapters.is_empty() {
        return "Nothing was measured.".to_owned();
    }
    let merged = || chapters.iter().flat_map(|chapter| &chapter.group.methods);
    let methods: BTreeSet<&str> = merged().map(|merged| merged.method.as_str()).collect();
    let frames: u64 = merged().map(|merged| merged.total.frames).sum();
    let machines: BTreeSet<String> = merged()
        .flat_map(|merged| &merged.runs)
        .map(|run| format!("{}, {}", run.machine, count(run.threads as u64, "thread")))
        .collect();
    let mut facts = vec![
        count(chapters.len() as u64, "data set"),
        count(methods.len() as u64, "method"),
        format!("{} processed in all", count(frames, "frame")),
    ];
    facts.extend(machines.iter().map(|machine| escape(machine)));
    facts.join(" · ")
}

/// Where a section is.
fn anchor(chapter: usize, section: &str) -> String {
    format!("d{chapter}-{section}")
}

/// The title of a table below the heading of its data set.
fn short_title<'a>(table: &'a Table, group: &Group) -> &'a str {
    let rest = table.title.strip_prefix(&group.dataset).and_then(|rest| rest.strip_prefix(": "));
    rest.unwrap_or(&table.title)
}

fn contents(chapters: &[Chapter]) -> String {
    let link = |to: &str, text: &str| format!("<a href=\"#{to}\">{}</a>", escape(text));
    let mut out = String::new();
    for (i, chapter) in chapters.iter().enumerate() {
        let tables = chapter.tables.iter().enumerate();
        let mut links: Vec<String> = tables
            .map(|(k, table)| {
                link(&anchor(i, &format!("t{k}")), short_title(table, &chapter.group))
            })
            .collect();
        let plots = curves::html(&chapter.group);
        for (section, name, is_there) in [
            ("curves", "curves", !plots.is_empty()),
            ("times", "stage times", bars::has_any(&chapter.group)),
            ("gallery", "best and worst frames", gallery::has_any(&chapter.group)),
        ] {
            if is_there {
                links.push(link(&anchor(i, section), name));
            }
        }
        let links: String = links.iter().map(|link| format!("<li>{link}</li>")).collect();
        out += &format!(
            "<div><b>{}</b><ul>{links}</ul></div>",
            link(&format!("d{i}"), &chapter.group.dataset)
        );
    }
    out
}

fn write_chapter(
    i: usize,
    chapter: &Chapter,
    evaluation: &Evaluation,
    gallery: &mut Gallery,
    out: &mut impl Write,
) -> io::Result<()> {
    let Chapter { group, tables } = chapter;
    write!(out, "<h2 class=\"dataset\" id=\"d{i}\">{}</h2>", escape(&group.dataset))?;
    out.write_all(glance(group).as_bytes())?;
    for (k, table) in tables.iter().enumerate() {
        let id = anchor(i, &format!("t{k}"));
        out.write_all(grid::section(&id, short_title(table, group), table).as_bytes())?;
    }
    let section = |name: &str, title: &str, inside: &str| {
        format!("<section id=\"{}\"><h2>{title}</h2>{inside}</section>", anchor(i, name))
    };
    let plots = curves::html(group);
    if !plots.is_empty() {
        out.write_all(section("curves", "Curves", &plots).as_bytes())?;
    }
    if bars::has_any(group) {
        out.write_all(section("times", "Stage times", &bars::html(group)).as_bytes())?;
    }
    if gallery::has_any(group) {
        let pictures = gallery.html(evaluation, group);
        out.write_all(section("gallery", "Best and worst frames", &pictures).as_bytes())?;
    }
    Ok(())
}

/// Our own main figures in large letters.
fn glance(group: &Group) -> String {
    let Some(ours) = group.method(OURS) else { return String::new() };
    let figures = &ours.figures;
    let share = |value: f64| format!("{value:.2}");
    let mut out = String::new();
    let mut kpi = |value: Option<String>, unit: &str, what: &str| {
        if let Some(value) = value {
            out += &format!(
                "<div class=\"kpi\"><b>{value} <small>{unit}</small></b><span>{what}</span></div>"
            );
        }
    };
    kpi(figures.salient.and_then(|s| s.f1).map(share), "F1", "of salient pixels");
    kpi(figures.region_f1(0.5).map(share), "F1", "of regions at IoU ≥ 0.5");
    kpi(figures.matched.map(percent), "", "of the image is matched");
    kpi(figures.in_roi().map(|d| share(d.epe_px)), "px", "disparity error where matched");
    let times = figures.times;
    let pace =
        times.map_or_else(String::new, |t| format!("per frame · {:.0} Hz", 1000.0 / t.total.p50));
    kpi(times.map(|t| ms(t.total.p50)), "ms", &pace);
    kpi(figures.saved_total.map(percent), "", "less time than full-frame SGM");
    if out.is_empty() {
        out
    } else {
        format!("<p class=\"sub\">{}:</p><div class=\"kpis\">{out}</div>", escape(ours.label()))
    }
}

/// What the heads of the tables mean.
fn words(chapters: &[Chapter]) -> String {
    let mut seen = BTreeSet::new();
    let columns = chapters.iter().flat_map(|chapter| &chapter.tables).flat_map(|t| &t.columns);
    columns
        .filter(|column| !column.help.is_empty() && seen.insert((&column.name, &column.help)))
        .map(|c| format!("<dt>{}</dt><dd>{}</dd>", escape(&c.name), escape(&c.help)))
        .collect()
}

/// The colour of a method in plots, the same for every data set.
fn color(group: &Group, method: &Merged) -> String {
    let known = super::group::place(&method.method);
    let strange = group.compared().iter().position(|other| other.method == method.method);
    format!("var(--m{})", known.or(strange).unwrap_or(0) % COLORS)
}

/// Number of colours in the style.
const COLORS: usize = 10;
