//! What indexes over moving objects cost: moving, updating, finding what a view volume meets and drawing
//! it, frame by frame, in the way and the words of Wortel 2011, chapters 4 and 5. It must not know reports.
//!
//! | file | what |
//! |---|---|
//! | `contender` | who is compared, with the knobs of each on each scene |
//! | `measure` | a contender run over a scene's frames |
//! | `tune` | the search for a contender's knobs |

mod contender;
mod measure;
mod tune;

pub use contender::{Contender, Method, SCENES, Tuned, beyond, contenders};
pub use measure::{Look, Survey, SurveyKnobs, look, survey};
pub use tune::{MOST_FOUND, Trial, tune};
