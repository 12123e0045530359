//! Cullers of other engines: what they are told of a scene, and what they answer. It must not know how the
//! answers are judged, nor reports.
//!
//! # The format, version 1
//! Lines of JSON, UTF-8, one object each. Numbers are written so that they read back to the same bits; a
//! number that is not finite is `null`. Matrices are 16 numbers, column after column, for column vectors;
//! the world is right-handed with y up. Clip space has x to the right, y up, and z from 0 at the near plane
//! to w at the far plane, or from w at the near plane to 0 at the far one where `depth` is reversed. Column 0, row 0 of the picture is on top on the left. Readers must ignore fields
//! that they do not know; a field that changes its meaning or goes raises the version.
//!
//! **Frames**, what `export` writes and a culler reads. The first line:
//!
//! | field | |
//! |---|---|
//! | `plainsight`, `version` | `"frames"`, 1 |
//! | `scene`, `seed` | name; seed of every random stream |
//! | `frames`, `views` | how many frames there are, and views of each: cameras that are judged by themselves |
//! | `viewport` | pixels: width, height |
//! | `depth` | `"forward"`, or `"reversed"` for a buffer whose greater depths are the nearer ones |
//! | `parts` | every part, by id from 0: `object`, `mesh` and `primitive` (in the glTF file), `triangles`, and `min` and `max`, its tight box in the object's space |
//! | `objects` | every object, by id from 0: `mesh`, `first_part`, `parts` (how many; their ids follow one another) |
//!
//! Then a line for each view of each frame, in order:
//!
//! | field | |
//! |---|---|
//! | `frame`, `view` | from 0 |
//! | `eye`, `forward` | the camera in the world; `forward` has length 1 |
//! | `fov_y`, `shift` | radians; where `forward` is off the middle, shares of half the picture to the left and down. `null` where rays are parallel |
//! | `height` | world units from the bottom of the picture to its top where rays are parallel, else `null` |
//! | `near`, `far` | along `forward`; `far` is `null` where it is infinite |
//! | `clip_from_world` | a matrix |
//! | `moved` | objects that stand elsewhere than in the frame before, all of them in frame 0: `object`, `world_from_object`, `min` and `max` (a box in the world that holds it), `jumped` (farther than it moves by itself). The same in each view of a frame |
//!
//! A part is drawn with the product of `clip_from_world` and `world_from_object`, taken in f64 and rounded
//! to f32 once, as `reference/src/lib.rs` says.
//!
//! **Drawn**, what a culler writes and `judge` reads. The first line: `{"plainsight": "drawn", "version": 1,
//! "culler": "its name"}`. Then a line for each view of each frame, in the same order: `frame`, `view` (0
//! where it is left out) and `drawn`, the ids of all parts drawn, in any order; twice is as good as once.
//! A line may be written as soon as its frame was read, and must be before the next is waited for.

mod drawn;
mod frames;
mod gltf;

pub use drawn::{Drawn, ForeignError};
pub use frames::{frame_line, header_line};
pub use gltf::{GltfFile, gltf_file};

/// Version of both formats.
pub const VERSION: u32 = 1;
