//! Stress: whole worlds picked by a seed, run and judged by the thousand. A seed decides the scene (the
//! generator `swarm`), the picture, the cut, the culler with all it stands on, and the device's schedule;
//! what it picked is said beside it. It must not know reports.
//!
//! The idea of a seed that is a whole simulated world, with a schedule of its own, is that of Zhou et al. 2021
//! (*FoundationDB: A distributed unbundled transactional key value store*, section 4); that of leaving
//! features out at random is Groce et al. 2012 (*Swarm testing*).
//!
//! | file | what |
//! |---|---|
//! | `array` | seeds to levels, every pair of them evenly |
//! | `choice` | what a seed picks |
//! | `knobs` | limits as a seed draws them, tiny |
//! | `member` | what was picked, by name |
//! | `beside` | indexes held to their promises beside a run |
//! | `world` | one seed's world run and judged |
//! | `probe` | situations that a sweep should reach |
//! | `tally` | outcomes added up, from one sweep or from the lines of many |
//! | `shard` | which seeds are this machine's |
//! | `shrink` | a failing world made as small as it goes |

mod array;
mod beside;
mod choice;
mod knobs;
mod member;
mod probe;
mod shard;
mod shrink;
mod tally;
mod world;

pub use choice::{Choice, Device, LARGE_ONE_IN, Room, Source, seed_of};
pub use knobs::Policy;
pub use member::{RAREST_MEMBER_ONE_IN, RAREST_PAIR_ONE_IN};
pub use probe::{Probe, Reached};
pub use shard::{Shard, ShardError};
pub use shrink::{FirstFailure, Shrunk, shrink, size};
pub use tally::{Tally, VERSION};
pub use world::{Judged, MakeReal, Outcome, REPEATED_ONE_IN, judged, judged_in};
