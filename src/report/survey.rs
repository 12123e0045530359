//! Surveys of indexes over moving objects beside the figures of Wortel 2011, chapter 5.

use super::columns::{Column, Columns, wrapped};
use crate::survey::Survey;

/// Table 5.1 of the thesis: milliseconds a frame on the city scene. Name, move, update, visibility, render
/// and total time, then what of update and visibility and what of the total is less than Octree 2's, in
/// per cent.
pub const TABLE_5_1: &[(&str, [f64; 7])] = &[
    ("1", [70.00, 15.6, 0.26, 29.96, 115.81, -14.84, 3.47]),
    ("2", [69.41, 13.52, 0.28, 36.75, 119.98, 0.0, 0.0]),
    ("3bR", [69.8, 12.51, 0.45, 36.19, 118.95, 6.14, 0.85]),
    ("3bR DR/OCL", [69.57, 2.13, 0.49, 35.85, 108.04, 81.02, 9.94]),
    ("4", [70.50, 13.75, 0.37, 35.76, 120.38, -2.26, -0.33]),
    ("4 DR/OCL", [70.35, 1.87, 0.41, 35.53, 108.16, 83.47, 9.84]),
];

/// The contender that others are set beside.
const STANDARD: &str = "2";

fn column<T>(all: &[T], name: &'static str, cell: impl Fn(&T) -> String) -> Column {
    Column { head: (name, 1), cells: all.iter().map(cell).collect() }
}

fn each(survey: &Survey, ns: u64) -> f64 {
    ns as f64 / f64::from(survey.frames.max(1)) / 1e6
}

fn tree(survey: &Survey) -> f64 {
    each(survey, survey.update_ns + survey.find_ns)
}

fn render(survey: &Survey) -> f64 {
    survey.render_ns as f64 / f64::from(survey.rendered.max(1)) / 1e6
}

fn total(survey: &Survey) -> f64 {
    each(survey, survey.move_ns) + tree(survey) + render(survey)
}

fn of<'a>(all: &'a [Survey], name: &str) -> Option<&'a Survey> {
    all.iter().find(|survey| survey.contender == name)
}

/// How much less than that of the standard a figure is, per cent.
fn less(all: &[Survey], survey: &Survey, figure: fn(&Survey) -> f64) -> String {
    of(all, STANDARD).map_or_else(String::new, |standard| {
        format!("{:.1}", (1.0 - figure(survey) / figure(standard)) * 100.0)
    })
}

/// The times of a scene's surveys as Table 5.1 has them, with the thesis's update, visibility and share
/// beside, where the scene is its city.
#[must_use]
pub fn time_table(all: &[Survey], width: Option<usize>) -> String {
    let city = all.first().is_some_and(|survey| survey.scene == "city250k");
    let published = |survey: &Survey, place: usize| {
        let row = TABLE_5_1.iter().find(|(name, _)| city && *name == survey.contender);
        row.map_or_else(String::new, |(_, row)| row[place].to_string())
    };
    let groups = vec![
        vec![
            column(all, "move", |s| format!("{:.2}", each(s, s.move_ns))),
            column(all, "update", |s| format!("{:.3}", each(s, s.update_ns))),
            column(all, "find", |s| format!("{:.3}", each(s, s.find_ns))),
            column(all, "median", |s| format!("{:.3}", s.median_ns as f64 / 1e6)),
            column(all, "render", |s| format!("{:.2}", render(s))),
            column(all, "total", |s| format!("{:.2}", total(s))),
            column(all, "%tree", |s| less(all, s, tree)),
            column(all, "%total", |s| less(all, s, total)),
        ],
        vec![
            column(all, "thesis UT", |s| published(s, 1)),
            column(all, "VT", |s| published(s, 2)),
            column(all, "%tree", |s| published(s, 5)),
            column(all, "%total", |s| published(s, 6)),
        ],
    ];
    let names = all.iter().map(|survey| survey.contender.to_owned()).collect();
    Columns { head: ("ms a frame".to_owned(), 12), names, groups }.text(width)
}

/// What was found of what there is, as Figures 5.1 and 5.2 have it, and the knobs.
#[must_use]
pub fn found_table(all: &[Survey], width: Option<usize>) -> String {
    let mean = |survey: &Survey, count: u64| {
        format!("{:.0}", count as f64 / f64::from(survey.frames.max(1)))
    };
    let groups = vec![vec![
        column(all, "found", |s| mean(s, s.found)),
        column(all, "actual", |s| mean(s, s.actual)),
        column(all, "ratio", |s| format!("{:.3}", s.found as f64 / s.actual.max(1) as f64)),
        column(all, "bytes an object", |s| {
            format!("{:.1}", s.heap_bytes as f64 / f64::from(s.objects.max(1)))
        }),
        column(all, "knobs", |s| s.knobs.clone()),
    ]];
    let names = all.iter().map(|survey| survey.contender.to_owned()).collect();
    Columns { head: ("meshes".to_owned(), 12), names, groups }.text(width)
}

/// Operations a frame; and in brackets, as Figures 5.7 and 5.9 have them, of Octree 2's in per cent.
#[must_use]
pub fn work_table(all: &[Survey], width: Option<usize>) -> String {
    let cell = |survey: &Survey, count: &dyn Fn(&Survey) -> f64| {
        let share = of(all, STANDARD)
            .map(count)
            .filter(|&whole| whole > 0.0)
            .map(|whole| format!(" ({:.0})", count(survey) / whole * 100.0));
        format!("{:.0}{}", count(survey), share.unwrap_or_default())
    };
    let a_frame = |count: fn(&Survey) -> u64| {
        move |survey: &Survey| count(survey) as f64 / f64::from(survey.frames.max(1))
    };
    let groups = vec![vec![
        column(all, "object ok", |s| cell(s, &a_frame(|s| s.work.ok))),
        column(all, "nodes", |s| cell(s, &|s| f64::from(s.nodes))),
        column(all, "steps", |s| cell(s, &a_frame(|s| s.work.steps))),
        column(all, "updates", |s| cell(s, &a_frame(|s| s.work.updates))),
        column(all, "node checks", |s| cell(s, &a_frame(|s| s.work.node_checks))),
        column(all, "object checks", |s| cell(s, &a_frame(|s| s.work.object_checks))),
        column(all, "lowered", |s| cell(s, &a_frame(|s| s.work.lowered))),
    ]];
    let names = all.iter().map(|survey| survey.contender.to_owned()).collect();
    Columns { head: ("a frame (% of 2)".to_owned(), 12), names, groups }.text(width)
}

/// What the thesis says in words, and what these surveys say.
#[must_use]
pub fn claims(all: &[Survey], width: Option<usize>) -> String {
    let Some(two) = of(all, STANDARD) else { return String::new() };
    let share = |name: &str, figure: fn(&Survey) -> f64| {
        of(all, name).map(|survey| figure(survey) / figure(two) * 100.0)
    };
    let update: fn(&Survey) -> f64 = |survey| each(survey, survey.update_ns);
    let ratio = |name: &str| of(all, name).map(|s| s.found as f64 / s.actual.max(1) as f64);
    let mut lines: Vec<String> = Vec::new();
    let mut say = |thesis: &str, here: Option<String>| {
        lines.extend(here.map(|here| wrapped(&format!("{thesis} Here {here}."), width)));
    };
    say(
        "Octree 1 always finds too many (section 5.1).",
        ratio("1").map(|ratio| format!("it finds {ratio:.2} times what there is")),
    );
    let city = two.scene == "city250k";
    if city {
        say(
            "Octree 4 with depth reduction and checklists is 83.47 % faster than Octree 2 on the octree operations (section 5.3).",
            share("4 DR/OCL", tree).map(|part| format!("{:.1} %", 100.0 - part)),
        );
        say(
            "Trees 2, 3bR and 4 are very similar on the city (section 5.2.2).",
            share("3bR", tree).zip(share("4", tree)).map(|(b, four)| {
                format!("3bR takes {b:.0} % and 4 takes {four:.0} % of what 2 takes")
            }),
        );
    } else {
        say(
            "Octree 4 is about one third faster on the spheres than Octree 2 (section 5.2.2).",
            share("4", tree).map(|part| format!("it takes {part:.0} % of the time")),
        );
        say(
            "With depth reduction and checklists its updates take 3.33 ms, about a fourth of Octree 2's, and all about half.",
            share("4 DR/OCL", update)
                .zip(share("4 DR/OCL", tree))
                .map(|(updates, whole)| format!("updates take {updates:.0} %, all {whole:.0} %")),
        );
        let less = of(all, "3bR DR/OCL").zip(of(all, "3bR"));
        say(
            "With both, Octree 3bR's updates take less than half the time they otherwise take.",
            less.map(|(with, without)| format!("{:.0} %", update(with) / update(without) * 100.0)),
        );
    }
    let medians = of(all, "4 DR/OCL").zip(of(all, "lazy grid"));
    say(
        "Beyond the thesis: the lazy grid.",
        medians.map(|(four, grid)| {
            format!(
                "{:.2} times as fast as Octree 4 with both in the median frame, {:.2} in the mean, and it finds {:.3} times what there is",
                four.median_ns as f64 / grid.median_ns.max(1) as f64,
                tree(four) / tree(grid),
                grid.found as f64 / grid.actual.max(1) as f64
            )
        }),
    );
    lines.join("\n")
}
