//! Cut meshes in a folder: what is read is what would be cut, bit for bit; what is damaged is cut anew.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use plainsight::part::{Cache, Crossing, Made, PartedMesh, Partition, PartitionKnobs};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Mesh, Scene, Stream};

use crate::common::{SCENES, leaf_triangles};

/// Up to the counts of positions, triangles, parts and nodes: magic, version, key.
const COUNTS_AT: usize = 8 + 4 + 32;
/// With the counts.
const HEADER: usize = COUNTS_AT + 16;
/// The checksum at the end.
const CHECKSUM: usize = 32;

fn scene(name: &str, scale: f64) -> Scene {
    build(name, &Knobs { seed: Some(3), scale: Some(scale), ..Knobs::default() }).unwrap()
}

fn make(scene: &Scene, knobs: PartitionKnobs, folder: &Path) -> (Partition, Made) {
    let cache = Cache::open(folder).unwrap();
    Partition::make(scene, knobs, Some(&cache), &|_, _| {})
}

/// Every field of every mesh as words, floats as their bits; drawables are a function of the others.
fn words(partition: &Partition) -> Vec<(Vec<u32>, String)> {
    let of = |mesh: &std::sync::Arc<PartedMesh>| {
        let mut words: Vec<u32> = mesh.positions.iter().flatten().map(|c| c.to_bits()).collect();
        words.extend(mesh.triangles.iter().flatten());
        for run in [&mesh.ranks, &mesh.part_of_rank, &mesh.triangle_of_rank, &mesh.source_of_rank] {
            words.extend(run);
        }
        // Written so that it reads back, with the sign of a zero.
        let rest = format!("{:?} {:?} {:?}", mesh.parts, mesh.tree, mesh.bounds);
        (words, format!("{rest} {}", mesh.drawable.len()))
    };
    partition.meshes().iter().map(of).collect()
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

#[test]
fn what_is_read_is_what_would_be_cut() {
    let folder = tempfile::tempdir().unwrap();
    for name in SCENES {
        let scene = scene(name, 0.02);
        for crossing in [Crossing::Split, Crossing::Whole] {
            let knobs = PartitionKnobs { leaf_triangles: leaf_triangles(name) / 4, crossing };
            let cut = Partition::new(&scene, knobs);
            let trees = cut.meshes().iter().filter(|mesh| mesh.tree.is_some()).count();
            assert!(trees > 0, "{name}: nothing is cut");
            let (first, _) = make(&scene, knobs, folder.path());
            let (again, made) = make(&scene, knobs, folder.path());
            assert_eq!((made.cut, made.loaded as usize), (0, scene.meshes.len()), "{name}");
            assert!(made.warnings.is_empty(), "{:?}", made.warnings);
            assert!(words(&first) == words(&cut), "{name} {crossing:?}: cut another way");
            assert!(words(&again) == words(&cut), "{name} {crossing:?}: read another way");
        }
    }
    for path in files(folder.path()).into_keys() {
        assert_eq!(path.extension().unwrap(), "tree", "nothing half-written is left");
    }
}

/// The knobs and the mesh are in the name: another leaf size or crossing, or one coordinate, and
/// nothing is found.
#[test]
fn another_mesh_or_knob_is_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene("soup", 0.005);
    let knobs = |leaf_triangles, crossing| PartitionKnobs { leaf_triangles, crossing };
    let expect_cut = |scene: &Scene, knobs| {
        let before = files(folder.path()).len();
        let (_, made) = make(scene, knobs, folder.path());
        assert!(made.loaded == 0 && files(folder.path()).len() > before, "{knobs:?}: {made:?}");
    };
    expect_cut(&scene, knobs(64, Crossing::Split));
    expect_cut(&scene, knobs(65, Crossing::Split));
    expect_cut(&scene, knobs(64, Crossing::Whole));
    for mesh in &mut scene.meshes {
        let mut positions = mesh.positions().to_vec();
        positions[0][1] = positions[0][1].next_up();
        let triangles = mesh.triangles().to_vec();
        *mesh = Mesh::new("moved", positions, triangles).unwrap().into();
    }
    expect_cut(&scene, knobs(64, Crossing::Split));
}

/// One mesh of a few parts in a folder of its own, with the file's bytes.
struct Small {
    scene: Scene,
    knobs: PartitionKnobs,
    folder: tempfile::TempDir,
    path: PathBuf,
    whole: Vec<u8>,
    expected: Vec<(Vec<u32>, String)>,
}

impl Small {
    fn new() -> Self {
        let mut scene = scene("soup", 0.001);
        // A square of 4 × 4 small squares, each two triangles, uneven so that planes cross some.
        let mut stream = Stream::new(1, "points");
        let mut point = |i: u32| [(i % 5) as f32, stream.unit() as f32, (i / 5) as f32 * 1.3];
        let points = (0..25).map(&mut point).collect();
        let square = |i: u32| [[i, i + 1, i + 5], [i + 1, i + 6, i + 5]];
        let triangles = (0..20).filter(|i| i % 5 < 4).flat_map(square).collect();
        scene.meshes = vec![Mesh::new("square", points, triangles).unwrap().into()];
        scene.objects.truncate(1);
        scene.objects[0].mesh = 0;
        let knobs = PartitionKnobs { leaf_triangles: 12, crossing: Crossing::Split };
        let folder = tempfile::tempdir().unwrap();
        let (partition, _) = make(&scene, knobs, folder.path());
        assert!(partition.meshes()[0].parts.len() > 2);
        let (path, whole) = files(folder.path()).pop_first().unwrap();
        Self { scene, knobs, folder, path, whole, expected: words(&partition) }
    }

    /// With these bytes in the file: the same mesh all the same, one warning, the file whole again.
    fn cut_anew(&self, bytes: &[u8], says: &str) {
        std::fs::write(&self.path, bytes).unwrap();
        let (partition, made) = make(&self.scene, self.knobs, self.folder.path());
        assert_eq!((made.cut, made.loaded, made.warnings.len()), (1, 0, 1), "{says}: {made:?}");
        let warning = &made.warnings[0];
        let name = self.path.file_name().unwrap().to_str().unwrap();
        assert!(warning.contains(name) && warning.contains(says), "{says}: {warning}");
        assert_eq!(warning.lines().count(), 1);
        assert!(words(&partition) == self.expected, "{warning}");
        assert!(
            files(self.folder.path()) == BTreeMap::from([(self.path.clone(), self.whole.clone())])
        );
    }

    /// The same bytes, changed, under a checksum that fits.
    fn signed(&self, change: impl Fn(&mut [u8])) -> Vec<u8> {
        let mut bytes = self.whole.clone();
        let content = bytes.len() - CHECKSUM;
        change(&mut bytes[..content]);
        let checksum = blake3::hash(&bytes[..content]);
        bytes[content..].copy_from_slice(checksum.as_bytes());
        bytes
    }
}

#[test]
fn a_truncated_file_is_cut_anew() {
    let small = Small::new();
    let length = small.whole.len();
    for end in (0..HEADER + 200).chain((HEADER + 200..length).step_by(37)) {
        let says = if end < HEADER { "is no object tree" } else { "has the wrong length" };
        small.cut_anew(&small.whole[..end], says);
    }
    small.cut_anew(&[&small.whole[..], b"\n"].concat(), "has the wrong length");
}

#[test]
fn a_flipped_bit_is_cut_anew() {
    let small = Small::new();
    let places = (0..HEADER + 300).chain((HEADER + 300..small.whole.len()).step_by(13));
    for (number, place) in places.enumerate() {
        let mut bytes = small.whole.clone();
        bytes[place] ^= 1 << (number % 8);
        let says = match place {
            0..8 => "is no object tree",
            8..12 => "has format",
            12..COUNTS_AT => "holds another mesh",
            COUNTS_AT..HEADER => "has the wrong length",
            _ => "has a wrong checksum",
        };
        small.cut_anew(&bytes, says);
    }
}

#[test]
fn a_foreign_file_is_cut_anew() {
    let small = Small::new();
    small.cut_anew(&small.signed(|bytes| bytes[8] += 1), "has format 2, this is format 1");
    small.cut_anew(b"version = 1\ngenerator = \"city\"\n", "is no object tree");
    small.cut_anew(&vec![0; small.whole.len()], "is no object tree");
    // Another mesh's file under this mesh's name.
    let other =
        Small { knobs: PartitionKnobs { leaf_triangles: 9, ..small.knobs }, ..Small::new() };
    let folder = tempfile::tempdir().unwrap();
    make(&other.scene, other.knobs, folder.path());
    small.cut_anew(&files(folder.path()).pop_first().unwrap().1, "holds another mesh");
}

/// What a checksum does not catch, since it fits: whatever is in a file, it is refused or sound.
#[test]
fn a_file_with_a_right_checksum_is_sound_or_cut_anew() {
    let small = Small::new();
    let count =
        |at: usize| u32::from_le_bytes(small.whole[at..at + 4].try_into().unwrap()) as usize;
    let [positions, triangles, parts, nodes] = [0, 4, 8, 12].map(|at| count(COUNTS_AT + at));
    assert_eq!(nodes, 2 * parts - 1);
    let sizes = HEADER + 48;
    let tree = sizes + parts * 8;
    let points = tree + nodes * 72;
    let corners = points + positions * 12;
    let sources = corners + triangles * 12;
    assert_eq!(sources + triangles * 4 + CHECKSUM, small.whole.len());
    let put = |at: usize, word: u32| {
        small.signed(move |bytes| bytes[at..at + 4].copy_from_slice(&word.to_le_bytes()))
    };
    for (bytes, says) in [
        (put(HEADER, u32::MAX), "the box does not hold the mesh"),
        (put(sizes, u32::MAX), "parts hold more than there is"),
        (put(sizes, 0), "a triangle names a position beyond its part"),
        (put(sizes + 4, 0), "a part is empty"),
        (put(tree + 48, 7), "the tree is not in depth-first order"),
        (put(tree + 52, u32::MAX - 1), "the tree is not in depth-first order"),
        (put(tree + 56, 3), "a plane is none"),
        (put(tree + 60, f32::NAN.to_bits()), "a plane is none"),
        (put(tree + 64, 1), "a node's parts are not its children's"),
        (put(tree + 68, 1), "a node's parts are not its children's"),
        (put(points, f32::INFINITY.to_bits()), "a position is not finite"),
        (put(points, 1e9_f32.to_bits()), "is too small"),
        (put(corners, positions as u32), "a triangle names a position beyond its part"),
        (put(sources, u32::MAX), "the fragments of a part are out of order"),
        (put(sources + triangles * 4 - 4, u32::MAX), "a source triangle is out of range"),
    ] {
        small.cut_anew(&bytes, says);
    }
    for (number, place) in (HEADER..small.whole.len() - CHECKSUM).step_by(3).enumerate() {
        std::fs::write(&small.path, small.signed(|bytes| bytes[place] ^= 1 << (number % 8)))
            .unwrap();
        let (partition, made) = make(&small.scene, small.knobs, small.folder.path());
        assert_eq!(made.cut as usize, made.warnings.len());
        assert!(made.cut == 0 || words(&partition) == small.expected);
        let mesh = &partition.meshes()[0];
        for (rank, &place) in mesh.triangle_of_rank.iter().enumerate() {
            assert_eq!(mesh.ranks[place as usize] as usize, rank);
        }
    }
}

/// A file that can be neither read nor replaced costs a warning.
#[test]
fn a_folder_in_the_place_of_a_file_is_a_warning() {
    let small = Small::new();
    std::fs::remove_file(&small.path).unwrap();
    std::fs::create_dir(&small.path).unwrap();
    let (partition, made) = make(&small.scene, small.knobs, small.folder.path());
    assert!(words(&partition) == small.expected);
    assert!(made.warnings.len() == 1 && made.warnings[0].contains("cannot keep"), "{made:?}");
    assert_eq!(std::fs::read_dir(small.folder.path()).unwrap().count(), 1, "nothing half-written");
}

#[test]
fn progress_counts_the_source_triangles() {
    let scene = scene("powerplant", 0.02);
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::open(folder.path()).unwrap();
    let knobs = PartitionKnobs { leaf_triangles: 512, ..PartitionKnobs::default() };
    let total: u64 = scene.meshes.iter().map(|mesh| mesh.triangles().len() as u64).sum();
    for _ in ["cut", "read"] {
        let told = Mutex::new(Vec::new());
        let tell = |done, all| told.lock().unwrap().push((done, all));
        let (partition, _) = Partition::make(&scene, knobs, Some(&cache), &tell);
        assert_eq!(partition.meshes().len(), scene.meshes.len());
        let mut told = told.into_inner().unwrap();
        assert_eq!(told[0], (0, total));
        assert_eq!(told.len(), 1 + scene.meshes.len());
        told.sort_unstable();
        assert_eq!(told.last(), Some(&(total, total)));
    }
}

/// Names hold the versions of the cut and of the format. Where this snapshot changes in what the files
/// hold and not in their names, old folders would be believed: raise `VERSION` in `part/cut.rs` or
/// `FORMAT_VERSION` in `part/pack.rs`.
#[test]
fn names_and_contents_of_one_version() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines = Vec::new();
    for (name, scale) in [("rooms", 0.01), ("soup", 0.01)] {
        for crossing in [Crossing::Split, Crossing::Whole] {
            let knobs = PartitionKnobs { leaf_triangles: 100, crossing };
            make(&scene(name, scale), knobs, folder.path());
        }
    }
    for (path, bytes) in files(folder.path()) {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let hash = blake3::hash(&bytes).to_hex();
        lines.push(format!("{} {} bytes {}", &name[..16], bytes.len(), &hash[..16]));
    }
    insta::assert_snapshot!(lines.join("\n"));
}
