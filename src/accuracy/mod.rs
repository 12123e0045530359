//! What accuracy costs in time: one knob after the other, and some pairs of them, each set to every value it
//! has, the same frames each time. What a setting loses (parts, pixels, depth) stands beside what it takes
//! (questions, virtual time, wall time), and the settings that nothing beats make the front.
//! It must not know reports.
//!
//! A setting that takes nothing from the truth must lose nothing: it goes through the gate like any run.
//!
//! | file | what |
//! |---|---|
//! | `knob` | the knobs, their values, the pairs |
//! | `worlds` | the scene cut in several ways, each once |
//! | `measure` | a setting run over a scene's frames |
//! | `renderer` | renderers with less or more arithmetic than the reference |
//! | `effects` | what each effect of a scene costs |
//! | `findings` | the front, and what the figures say in words |

mod effects;
mod findings;
mod knob;
mod measure;
mod renderer;
mod worlds;

pub use effects::{EffectPoint, effects};
pub use findings::{findings, front};
pub use knob::{KNOBS, Knob, PAIRS, Setting, Tuning, Value, settings};
pub use measure::{Point, measure};
pub use renderer::{RendererPoint, renderers};
pub use worlds::{MakeWorld, Worlds};
