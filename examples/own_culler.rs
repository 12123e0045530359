//! Puts a culler of one's own through the gate: it drops objects whose bounding sphere is behind the
//! camera. Run with `cargo run --release --example own_culler`.

use std::process::ExitCode;

use plainsight::check::judge;
use plainsight::cull::{Culler, CullerSetup, Pen, View};
use plainsight::oracle::OracleError;
use plainsight::part::ObjectId;
use plainsight::scene::generate::{Knobs, build};

/// Draws whatever is not wholly behind the camera.
struct BehindTheCamera;

impl Culler for BehindTheCamera {
    fn name(&self) -> &str {
        "behind-the-camera"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        for (number, object) in view.objects.iter().enumerate() {
            let radius = object.bounds.size().length() * 0.5;
            let ahead = (object.bounds.center() - view.camera.eye).dot(view.camera.forward);
            if ahead + radius >= 0.0 {
                for part in view.partition.parts_of(ObjectId(number as u32)) {
                    pen.draw(part);
                }
            }
        }
        Ok(())
    }
}

fn main() -> ExitCode {
    let knobs = Knobs { scale: Some(0.2), frames: Some(8), ..Knobs::default() };
    let mut held = true;
    for name in ["bunnies", "city", "rooms"] {
        let scene = build(name, &knobs).expect("the scene is generated");
        let make = |_: CullerSetup| Box::new(BehindTheCamera) as Box<dyn Culler>;
        let verdict = judge(scene, make).expect("the simulated device does not fail");
        let word = format!("{name}: {verdict}\n");
        std::io::Write::write_all(&mut std::io::stdout(), word.as_bytes())
            .expect("a place to print");
        held &= verdict.gate.held();
    }
    if held { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
