//! `list`: what there is to name.

use super::quiet::quietly;
use super::{CliError, EXIT_HELD, Streams};
use crate::cull::CullerKind;
use crate::index::INDEXES;
use crate::oracle::CostModel;
use crate::oracle::wgpu::{Gpu, NO_DEVICE};
use crate::scene::generate::{GENERATORS, HARD, SWARM};

pub(super) fn list(cullers: &[CullerKind], streams: &mut Streams<'_>) -> Result<u8, CliError> {
    let out = &mut streams.out;
    let mut section = |title: &str, lines: Vec<(String, String)>| -> std::io::Result<()> {
        writeln!(out, "{title}")?;
        let wide = lines.iter().map(|(name, _)| name.len()).max().unwrap_or(0).max(14);
        lines.iter().try_for_each(|(name, summary)| writeln!(out, "  {name:<wide$} {summary}"))
    };
    let pair = |name: &str, summary: &str| (name.to_owned(), summary.to_owned());
    let large = GENERATORS.iter().chain([&SWARM]);
    section("scenes", large.map(|g| pair(g.name, g.summary)).collect())?;
    section("hard scenes", HARD.iter().map(|g| pair(g.name, g.summary)).collect())?;
    section("cullers", cullers.iter().map(|c| pair(c.name, c.summary)).collect())?;
    let oracles = [
        ("sim", "the reference z-buffer, exact and at once"),
        (
            "hierarchical-z",
            "the reference's depth as a pyramid of maxima, a handful of texels a question",
        ),
        (
            "tables",
            "the reference's depth by tables of maxima, the answers of read-back without a device",
        ),
        (
            "simulated",
            "the reference as a device with a clock: late answers, doubt (--latency, --doubt)",
        ),
        (
            "last-frame",
            "the reference's depth of the frame before: what shows may be missing (see --late)",
        ),
        ("hardware", "occlusion queries of a Vulkan device through wgpu"),
        (
            "pyramid",
            "the same device and answers, by maxima of its depth in place of query objects",
        ),
        ("read-back", "the same answers, by maxima of depth that comes back from the device"),
        ("always", "everything is visible"),
    ];
    section("oracles", oracles.iter().map(|&(name, summary)| pair(name, summary)).collect())?;
    section("indexes", INDEXES.iter().map(|i| pair(i.name, i.summary)).collect())?;
    let models = CostModel::named();
    let models = models.iter().map(|model| pair(&model.name, &model.source));
    let file = pair("FILE.toml", "what `calibrate` measured and wrote");
    section("cost models", models.chain([file]).collect())?;
    section("devices", devices().into_iter().map(|name| (name, String::new())).collect())?;
    Ok(EXIT_HELD)
}

fn devices() -> Vec<String> {
    let adapters = quietly(Gpu::adapters);
    if adapters.is_empty() { vec![NO_DEVICE.to_owned()] } else { adapters }
}
