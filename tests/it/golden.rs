//! Golden pictures, compared exactly. A missing one fails; it is never written and passed. To renew
//! them run with PLAINSIGHT_WRITE_GOLDEN=1 (which fails as well) and look at every one before it is
//! committed.

use std::path::PathBuf;

use plainsight::cli::{EXIT_HELD, Streams, main};
use plainsight::cull::CULLERS;

fn compare(name: &str, scene: &str, layer: &str) {
    let golden =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.png"));
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("made.png");
    let line = format!(
        "plainsight picture --scene {scene} --seed 1 --scale 0.1 --viewport 320x256 --leaf 512 --frame 7 --layer {layer} --out"
    );
    let args = line.split(' ').map(Into::into).chain([made.clone().into_os_string()]);
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let code = main(args, CULLERS, Streams { out: &mut out, talk: &mut talk, width: None });
    assert_eq!(code, EXIT_HELD, "{}", String::from_utf8_lossy(&talk));
    if std::env::var_os("PLAINSIGHT_WRITE_GOLDEN").is_some() {
        std::fs::copy(&made, &golden).unwrap();
        panic!(
            "{} written: look at it, then run without PLAINSIGHT_WRITE_GOLDEN",
            golden.display()
        );
    }
    let pixels = |path: &PathBuf| {
        image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_rgb8()
    };
    let (want, got) = (pixels(&golden), pixels(&made));
    assert_eq!(want.dimensions(), got.dimensions());
    let differ = want.pixels().zip(got.pixels()).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "{differ} pixels differ from {}", golden.display());
}

macro_rules! golden {
    ($($name:ident: $scene:literal $layer:literal;)*) => {$(
        #[test]
        fn $name() {
            compare(stringify!($name), $scene, $layer);
        }
    )*};
}

golden! {
    bunnies_parts: "bunnies" "parts";
    bunnies_depth: "bunnies" "depth";
    bunnies_culled: "bunnies" "culled";
    bunnies_top: "bunnies" "top";
    city_parts: "city" "parts";
    city_depth: "city" "depth";
    city_culled: "city" "culled";
    city_top: "city" "top";
    rooms_parts: "rooms" "parts";
    rooms_depth: "rooms" "depth";
    rooms_culled: "rooms" "culled";
    rooms_top: "rooms" "top";
    soup_parts: "soup" "parts";
    soup_culled: "soup" "culled";
}
