//! `why`: the account of a part agrees with the truth and with what was drawn, and always has a reason.

use plainsight::cli::{EXIT_HELD, EXIT_USAGE, Streams, main};
use plainsight::cull::{CULLERS, CullerSetup, PerView, ProxyKind};
use plainsight::index::INDEXES;
use plainsight::oracle::CostModel;
use plainsight::part::{PartId, PartitionKnobs};
use plainsight::run::{Account, Made, Moment, PartTruth, World, account};
use plainsight::scene::generate::{Knobs, build};

use crate::common::oracle;

fn world(scene: &str) -> World {
    let scene = build(scene, &Knobs::default()).unwrap();
    let leaf_triangles = scene.leaf_triangles;
    World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
}

/// A reason that fits: what is culled is outside or was found hidden, and so is nothing that is drawn.
fn fits(account: &Account) -> bool {
    match account.decisive().map(|step| &step.made) {
        None => account.drawn,
        Some(Made::Outside(_) | Made::OnNoSample) => !account.drawn,
        Some(Made::Asked(question)) => question.visible == Some(account.drawn),
        Some(Made::Certain | Made::Remembered(_) | Made::WithNode) => account.drawn,
        Some(Made::NotReached | Made::LeftOut) => false,
    }
}

#[test]
fn every_part_has_a_reason_that_fits() {
    for (scene, moment) in [
        ("hard/pivots", Moment { frame: 3, view: 0 }),
        ("hard/split-screen", Moment { frame: 2, view: 1 }),
    ] {
        let world = world(scene);
        let entries = world.entries();
        let count = world.partition.part_count();
        let (mut drawn, mut culled, mut occluded) = (0, 0, 0);
        for kind in CULLERS {
            for part in (0..count).step_by(count as usize / 9).map(PartId) {
                let make = || {
                    (kind.make)(CullerSetup {
                        partition: world.partition.clone(),
                        index: (INDEXES[0].build)(&entries),
                        proxy: ProxyKind::Rectangle,
                        cost: CostModel::lavapipe(),
                    })
                };
                let mut culler = PerView::over(world.views(), make);
                let mut oracle = oracle("sim", &world);
                let told = (moment, part);
                let account = account(&world, told, culler.as_mut(), oracle.as_mut(), &mut || true);
                let account = account.unwrap();
                let name = format!("{scene} {} part {}", kind.name, part.0);
                assert!(fits(&account), "{name}: {:?}", account.decisive());
                match account.truth {
                    PartTruth::Visible { pixels, .. } => assert!(account.drawn && pixels > 0),
                    PartTruth::Hidden { by, depth, by_depth, .. } => {
                        assert!(by != part && by_depth <= depth, "{name}: {:?}", account.truth);
                        occluded += 1;
                    }
                    PartTruth::NoSample => {}
                }
                *if account.drawn { &mut drawn } else { &mut culled } += 1;
            }
        }
        assert!(drawn > 10 && culled > 10 && occluded > 10, "{scene}: {drawn} {culled} {occluded}");
    }
}

fn run(line: &str) -> (u8, String, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let args = line.split(' ').map(Into::into);
    let code = main(args, CULLERS, Streams { out: &mut out, talk: &mut talk, width: None });
    (code, String::from_utf8(out).unwrap(), String::from_utf8(talk).unwrap())
}

#[test]
fn it_is_said_in_words_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("why.png");
    let what = "plainsight why --scene hard/peeping --frame 9";
    let (code, out, talk) = run(&format!("{what} --part 20 --out {}", png.display()));
    assert_eq!(code, EXIT_HELD, "{talk}");
    insta::assert_snapshot!(out.replace(&png.display().to_string(), "why.png"));
    let picture = image::open(&png).unwrap().to_rgb8();
    let count = |color: [u8; 3]| picture.pixels().filter(|pixel| pixel.0 == color).count();
    // All of it is behind the wall, inside of what was asked about, less the arms of the cross.
    assert!(count([226, 40, 160]) > 60 && count([255, 255, 255]) > 20, "no part, no rectangle");
    assert_eq!(count([255, 214, 10]), 0, "nothing of it shows");
    let pixel = format!("{what} --pixel 100,100 --json --out {}", png.display());
    let (code, out, talk) = run(&pixel);
    assert_eq!(code, EXIT_HELD, "{talk}");
    let told: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&told["part"], &told["drawn"]), (&0.into(), &true.into()));
    for (wrong, says) in [
        ("--part 9999", "has 77 parts"),
        ("--part 1 --view 1", "has 1 views"),
        ("--pixel 1,1", "nothing shows there"),
        ("--pixel 1", "write it as X,Y"),
    ] {
        let (code, out, talk) = run(&format!("{what} {wrong} --out {}", png.display()));
        assert_eq!((code, out.as_str()), (EXIT_USAGE, ""), "{talk}");
        assert!(talk.contains(says), "{wrong} said {talk}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is half-written");
}
