//! The progress bar on standard error: object trees by triangles, then frames of lanes.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::signals::stop_where_interrupted;

/// Frames of all lanes, as far as they are known.
const FRAMES: &str = "{msg:<20} {bar:30} {pos}/{len} frames, {eta} left";
/// Triangles of the scene's meshes, cut or read.
const TRIANGLES: &str = "{msg:<20} {bar:30} {human_pos}/{human_len} triangles, {eta} left";

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// A bar of frames, hidden where standard error is no terminal.
pub(super) fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(8));
    bar.set_style(style(FRAMES));
    bar
}

/// Lends `bar` to `work` as one of triangles, done of all; then it counts frames where it stopped. A signal
/// ends it after the meshes at hand, by way of [`stop_where_interrupted`].
pub(super) fn counting_triangles<T>(
    bar: &ProgressBar,
    message: String,
    work: impl FnOnce(&(dyn Fn(u64, u64) + Sync)) -> T,
) -> T {
    let (position, length) = (bar.position(), bar.length().unwrap_or(0));
    bar.set_message(message);
    bar.set_style(style(TRIANGLES));
    bar.reset_eta();
    let made = work(&|done, all| {
        stop_where_interrupted();
        bar.set_length(all);
        bar.set_position(done);
    });
    bar.set_style(style(FRAMES));
    bar.set_length(length);
    bar.set_position(position);
    bar.reset_eta();
    made
}
