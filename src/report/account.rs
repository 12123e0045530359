//! The account of a part in words, and as a picture: the truth, dimmed, with the part and what was asked
//! about it.

use image::RgbImage;

use super::picture::part_picture;
use crate::cull::Item;
use crate::oracle::Proxy;
use crate::run::{Account, Made, PartTruth, Step, World};

/// What is left of a colour where the picture is dimmed, in 256ths.
const DIMMED: u16 = 80;
/// Samples of the part that show.
const SHOWS: [u8; 3] = [255, 214, 10];
/// Samples of the part that something stands before.
const HIDDEN: [u8; 3] = [226, 40, 160];
/// The edge of what was asked about.
const ASKED: [u8; 3] = [255, 255, 255];
/// The sample where it comes nearest.
const NEAREST: [u8; 3] = [0, 220, 255];
/// Pixels of each arm of the cross there.
const ARM: i64 = 5;

/// One line: a node by its place in both levels.
#[must_use]
pub fn item_name(item: Item) -> String {
    match item {
        Item::Scene(node) => format!("scene node {}", node.0),
        Item::Object(object, 0) => format!("object {}", object.0),
        Item::Object(object, node) => format!("object {}, node {node}", object.0),
    }
}

/// What the truth says, in a line.
#[must_use]
pub fn truth_line(truth: &PartTruth) -> String {
    match truth {
        PartTruth::Visible { pixels, first: [x, y] } => {
            format!("visible in {pixels} pixels, first at ({x}, {y})")
        }
        PartTruth::Hidden { samples, nearest: [x, y], depth, by, by_depth } => format!(
            "occluded: it covers {samples} samples and shows in none; nearest at ({x}, {y}), depth {depth}, where part {} stands before it at {by_depth}",
            by.0
        ),
        PartTruth::NoSample => {
            "it covers no sample: outside the picture, or between the samples".to_owned()
        }
    }
}

/// What was made of a node in `frame`, in a line.
#[must_use]
pub fn step_line(step: &Step, frame: u32) -> String {
    let what = match &step.made {
        Made::NotReached => "not reached".to_owned(),
        Made::Outside(plane) => {
            format!("beyond the {} plane of the frustum", format!("{plane:?}").to_lowercase())
        }
        Made::OnNoSample => "in the frustum, on no sample".to_owned(),
        Made::Certain => {
            "taken for visible without a question: it cannot be projected, or its contents may stick out"
                .to_owned()
        }
        Made::Remembered(None) => format!("{} unasked", into(step)),
        Made::Remembered(Some(question)) => format!(
            "{} unasked, then question {}{}: {}, which counts from the next frame on",
            into(step),
            question.query.0,
            others(question.items.len()),
            answer(question.visible)
        ),
        Made::Asked(question) => format!(
            "question {} of this frame{}{}: {}",
            question.query.0,
            others(question.items.len()),
            place(&question.proxies),
            answer(question.visible)
        ),
        Made::WithNode => "drawn with the scene node that holds it".to_owned(),
        Made::LeftOut => "left out without a question".to_owned(),
    };
    let mut line = format!("{}: {what}", item_name(step.item));
    if let Some((then, visible)) = step.latest {
        let (said, age) = (answer(Some(visible)), frame - then);
        line += &format!("; latest earlier answer: {said}, in frame {then}, {age} old");
    }
    if let Some(recall) = &step.recall {
        line += &format!("; {recall}");
    }
    line
}

fn into(step: &Step) -> &'static str {
    if step.is_part { "drawn" } else { "walked into" }
}

fn answer(visible: Option<bool>) -> &'static str {
    match visible {
        Some(true) => "visible",
        Some(false) => "hidden",
        None => "no answer",
    }
}

fn others(items: usize) -> String {
    if items > 1 { format!(", about {items} nodes together,") } else { String::new() }
}

fn place(proxies: &[Proxy]) -> String {
    match proxies {
        [Proxy::Rectangle { min, max, depth }] => {
            let [x0, y0] = min;
            let [x1, y1] = max.map(|end| end - 1);
            format!(", rectangle ({x0}, {y0}) to ({x1}, {y1}) at depth {depth}")
        }
        [_] | [] => String::new(),
        many => format!(", {} proxies", many.len()),
    }
}

/// The conclusion, in a line: whether it was drawn, and what decided.
#[must_use]
pub fn decision_line(account: &Account) -> String {
    let word = if account.drawn { "drawn" } else { "culled" };
    let Some(step) = account.decisive() else {
        return format!("{word}; this culler has no levels to give a reason");
    };
    let own = account.steps.last().is_some_and(|last| last.item == step.item);
    let by = if own { String::new() } else { format!(", inherited from {}", item_name(step.item)) };
    let why = match &step.made {
        Made::Outside(_) => "outside the frustum",
        Made::OnNoSample => "on no sample",
        Made::Certain => "certainly visible",
        Made::Remembered(_) if step.latest.is_none() => "not outside, and not asked about",
        Made::Remembered(_) => "visible when last heard of",
        Made::Asked(question) if question.visible == Some(true) => "the device saw it",
        Made::Asked(_) => "the device did not see it",
        Made::WithNode => "with its node",
        Made::LeftOut | Made::NotReached => "left out",
    };
    format!("{word}: {why}{by}")
}

/// The truth's image, dimmed; the part's samples yellow where they show and magenta where something stands
/// before them; white edges round the rectangles that decided; a cross where the part comes nearest.
#[must_use]
pub fn account_picture(world: &World, account: &Account) -> RgbImage {
    let mut picture = part_picture(world, &account.image);
    let (width, height) = picture.dimensions();
    for (sample, pixel) in picture.pixels_mut().enumerate() {
        pixel.0 = pixel.0.map(|c| ((u16::from(c) * DIMMED) >> 8) as u8);
        if let Some(own) = account.alone.draw_index(sample) {
            let shows = account.image.draw_index(sample) == Some(own);
            pixel.0 = if shows { SHOWS } else { HIDDEN };
        }
    }
    let mut set = |x: i64, y: i64, color: [u8; 3]| {
        if (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y) {
            picture.put_pixel(x as u32, y as u32, image::Rgb(color));
        }
    };
    let question = account.decisive().and_then(|step| match &step.made {
        Made::Asked(question) | Made::Remembered(Some(question)) => Some(question),
        _ => None,
    });
    for proxy in question.iter().flat_map(|question| &question.proxies) {
        if let Proxy::Rectangle { min, max, .. } = proxy {
            let [x0, y0] = min.map(i64::from);
            let [x1, y1] = max.map(|end| i64::from(end) - 1);
            (x0..=x1).for_each(|x| [y0, y1].into_iter().for_each(|y| set(x, y, ASKED)));
            (y0..=y1).for_each(|y| [x0, x1].into_iter().for_each(|x| set(x, y, ASKED)));
        }
    }
    if let PartTruth::Hidden { nearest: [x, y], .. } = account.truth {
        let (x, y) = (i64::from(x), i64::from(y));
        (-ARM..=ARM).filter(|&i| i != 0).for_each(|i| {
            set(x + i, y, NEAREST);
            set(x, y + i, NEAREST);
        });
    }
    picture
}
