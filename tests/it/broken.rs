//! A culler broken on purpose is caught: frame, part, pixel and replay line, exit 1.

use plainsight::cli::{EXIT_FAILED, EXIT_HELD, Streams, main};
use plainsight::cull::{Culler, CullerKind, CullerSetup, Pen, View};
use plainsight::math::rounded_clip_matrix;
use plainsight::oracle::{OracleError, part_instance};
use plainsight::part::PartId;
use plainsight_reference::fast::Options;
use plainsight_reference::{Image, fast};

/// The frame in which it goes wrong.
const BAD_FRAME: u32 = 7;

/// Draws everything, but for one part that shows in the picture of frame 7.
struct DropsOne;

fn visible_part(view: &View<'_>) -> PartId {
    let matrices: Vec<_> =
        view.objects.iter().map(|o| rounded_clip_matrix(&o.clip_from_object)).collect();
    let parts = (0..view.partition.part_count()).map(PartId);
    let all: Vec<_> = parts.map(|part| part_instance(view.partition, part, &matrices)).collect();
    let mut image = Image::new(view.viewport);
    fast::render(&mut image, &all, Options::default());
    let shown = (0..image.sample_count()).find_map(|sample| image.draw_index(sample));
    view.partition.part_of_draw(shown.expect("something is visible"))
}

impl Culler for DropsOne {
    fn name(&self) -> &str {
        "drops-one"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let dropped = (view.frame == BAD_FRAME).then(|| visible_part(view));
        let parts = (0..view.partition.part_count()).map(PartId);
        parts.filter(|&part| Some(part) != dropped).for_each(|part| pen.draw(part));
        Ok(())
    }
}

fn make(_: CullerSetup) -> Box<dyn Culler> {
    Box::new(DropsOne)
}

const BROKEN: &[CullerKind] =
    &[CullerKind { name: "drops-one", summary: "broken on purpose", asks: false, make }];

fn run(line: &str) -> (u8, String, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let args = line.split(' ').map(Into::into);
    let code = main(args, BROKEN, Streams { out: &mut out, talk: &mut talk, width: None });
    (code, String::from_utf8(out).unwrap(), String::from_utf8(talk).unwrap())
}

const SCENE: &str = "--scene rooms --seed 2 --scale 0.02 --viewport 200x160 --leaf 256";

#[test]
fn a_dropped_part_is_caught_and_replays() {
    for oracle in ["sim", "hardware"] {
        let (code, out, talk) =
            run(&format!("plainsight run {SCENE} --frames 9 --oracle {oracle} --culler drops-one"));
        assert_eq!(code, EXIT_FAILED, "{out}{talk}");
        assert!(out.contains("verdict: FAILED (0 of 1 lanes held"), "{out}");
        assert!(talk.contains("set: frame 7 part "), "{talk}");
        assert!(talk.contains("pixels, first at ("), "{talk}");
        assert!(talk.contains("image: 1 frames differ, first frame 7 in "), "{talk}");
        assert_eq!(
            oracle == "hardware",
            talk.contains("device image: 1 frames differ, first frame 7")
        );
        let replay = talk.lines().find_map(|line| line.trim().strip_prefix("replay: ")).unwrap();
        let (code, out, talk) = run(replay);
        assert_eq!(code, EXIT_FAILED, "{out}{talk}");
        assert!(!talk.contains("is not the expected"), "{talk}");
        assert!(talk.contains("set: frame 7 part "), "{talk}");
        let why = talk.lines().find_map(|line| line.trim().strip_prefix("why: ")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let (code, out, told) = run(&format!("{why} --out {}/why.png", folder.path().display()));
        assert_eq!(code, EXIT_HELD, "{out}{told}");
        assert!(out.contains("truth: visible in ") && out.contains("\nculled; "), "{out}");
        // The pixel that is named shows that part, and so it is found by its pixel as well.
        let (what, part) = why.rsplit_once(" --part ").unwrap();
        let pixel = talk.split(&format!("set: frame 7 part {part} is visible in ")).nth(1).unwrap();
        let pixel = pixel.split(['(', ')']).nth(1).unwrap().replace(' ', "");
        let file = folder.path().join("pixel.png");
        let by_pixel = format!("{what} --pixel {pixel} --out {}", file.display());
        let (_, by_pixel, _) = run(&by_pixel);
        assert!(by_pixel.contains(&format!("frame 7, part {part}: ")), "{by_pixel}");
    }
}

#[test]
fn before_the_bad_frame_it_holds() {
    let (code, out, talk) =
        run(&format!("plainsight run {SCENE} --frames 7 --oracle sim --culler drops-one"));
    assert_eq!(code, EXIT_HELD, "{out}{talk}");
}
