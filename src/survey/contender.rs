//! Who is compared: the trees of Wortel 2011 by their names there, with the knobs of each on each of the two
//! scenes, and what stands beside them. Knobs are tuned by the thesis's rule (section 5.1): what is found is
//! to be about 1.1 times what there is; `plainsight tune` finds them again.

use crate::index::{
    Entry, GridKnobs, Index, IrregularOctree, LazyGrid, List, LooseKnobs, RegularGrid, Split,
    TemporalVolumes, TreeKnobs, TwoLevelBsp, VolumeKnobs, bounds_octree, extents_octree,
    loose_octree, octree, overlapping_octree, radius_octree,
};

/// A tree of the thesis, or something beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Objects at the smallest node that holds them.
    One,
    /// The same with larger nodes.
    Two,
    /// Buckets, nodes as large as their contents.
    Three,
    /// Buckets, nodes larger by their largest object's sides.
    ThreeB,
    /// Buckets, nodes larger by their largest object's radius.
    ThreeBR,
    /// Middles say where, sizes how deep.
    Four,
    /// Parted where its objects are, which go down when looked at.
    Irregular,
    /// One level of cells.
    RegularGrid,
    /// The same over temporal bounding volumes.
    TemporalGrid,
    /// Octree 1 over temporal bounding volumes.
    TemporalOctree,
    /// The two-level BSP's scene tree.
    Bsp,
    /// Grids over one another, this project's own.
    LazyGrid,
    /// A look at every box.
    List,
}

/// A method with knobs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// Its name in the thesis, or its own.
    pub name: &'static str,
    /// What it is.
    pub method: Method,
    /// Its knobs; those it does not have are ignored.
    pub knobs: TreeKnobs,
    /// Those of tree 4 alone.
    pub loose: LooseKnobs,
}

impl Contender {
    /// Builds the index over the objects of frame 0.
    #[must_use]
    pub fn build(&self, entries: &[Entry]) -> Box<dyn Index> {
        let knobs = self.knobs;
        let grid = |held: &[Entry]| -> Box<dyn Index> {
            Box::new(RegularGrid::new(held, GridKnobs::default()))
        };
        match self.method {
            Method::One => octree(entries, knobs),
            Method::Two => overlapping_octree(entries, knobs),
            Method::Three => bounds_octree(entries, knobs),
            Method::ThreeB => extents_octree(entries, knobs),
            Method::ThreeBR => radius_octree(entries, knobs),
            Method::Four => loose_octree(entries, knobs, self.loose),
            Method::Irregular => Box::new(IrregularOctree::new(entries, knobs)),
            Method::RegularGrid => grid(entries),
            Method::TemporalGrid => Box::new(TemporalVolumes::new(
                "temporal-grid",
                VolumeKnobs::default(),
                entries,
                grid,
            )),
            Method::TemporalOctree => {
                let tree = |held: &[Entry]| octree(held, knobs);
                Box::new(TemporalVolumes::new(
                    "temporal-octree",
                    VolumeKnobs::default(),
                    entries,
                    tree,
                ))
            }
            Method::Bsp => Box::new(TwoLevelBsp::new(entries)),
            Method::LazyGrid => Box::new(LazyGrid::new(entries, GridKnobs::default())),
            Method::List => Box::new(List::new(entries)),
        }
    }

    /// The knobs that it has, in words.
    #[must_use]
    pub fn words(&self) -> String {
        let TreeKnobs { max_depth, size_divisor, capacity, start_depth, depth_reduction, .. } =
            self.knobs;
        let mut words = match self.method {
            Method::One | Method::TemporalOctree => format!("depth {max_depth}"),
            Method::Irregular => format!("{capacity} a node"),
            Method::Two | Method::Four => format!("depth {max_depth}, divisor {size_divisor}"),
            Method::Three | Method::ThreeB | Method::ThreeBR => {
                format!("{capacity} a node, start {start_depth}")
            }
            _ => String::new(),
        };
        if self.loose.shrink != LooseKnobs::default().shrink {
            words += &format!(", shrinking by {}", self.loose.shrink);
        }
        if self.loose.largest {
            words += ", by the largest below";
        }
        if self.knobs.leaf_boxes {
            words += ", leaves by boxes";
        }
        if depth_reduction > 0 {
            words += &format!(", reduced by {depth_reduction}");
        }
        if self.knobs.checklists {
            words += ", checklists";
        }
        words
    }
}

/// A scene of the thesis, and how it splits space there.
#[derive(Clone, Copy, Debug)]
pub struct Tuned {
    /// Its name.
    pub scene: &'static str,
    /// Octrees for the cloud, quadtrees for the flat city.
    pub split: Split,
    /// Whether the knobs are the thesis's own, or tuned on the scenes of this bench.
    contenders: fn(bool) -> Vec<Contender>,
    /// What the thesis names and does not measure.
    beyond: fn() -> Vec<Contender>,
}

/// The scenes of the thesis.
pub const SCENES: &[Tuned] = &[
    Tuned { scene: "city250k", split: Split::Quadrants, contenders: city, beyond: beyond_city },
    Tuned {
        scene: "spheres200k",
        split: Split::Octants,
        contenders: spheres,
        beyond: beyond_spheres,
    },
];

/// The contenders on a scene of [`SCENES`], with the knobs that the thesis gives or with those tuned here.
#[must_use]
pub fn contenders(scene: &Tuned, thesis: bool) -> Vec<Contender> {
    (scene.contenders)(thesis)
}

/// What the thesis names and does not measure, with knobs tuned here: the indexes of its related work
/// (section 2.2), and the options of its future work (section 6.2).
#[must_use]
pub fn beyond(scene: &Tuned) -> Vec<Contender> {
    (scene.beyond)()
}

fn of(name: &'static str, method: Method, knobs: TreeKnobs) -> Contender {
    Contender { name, method, knobs, loose: LooseKnobs::default() }
}

fn with(split: Split, max_depth: u8) -> TreeKnobs {
    TreeKnobs { max_depth, ..TreeKnobs::usual(split, 0) }
}

fn bucket(split: Split, capacity: u32, start_depth: u8) -> TreeKnobs {
    TreeKnobs { capacity, start_depth, ..with(split, TreeKnobs::DEEPEST) }
}

fn divided(split: Split, max_depth: u8, size_divisor: f64) -> TreeKnobs {
    TreeKnobs { size_divisor, ..with(split, max_depth) }
}

fn beside(split: Split) -> [Contender; 3] {
    let knobs = TreeKnobs::usual(split, 0);
    [
        of("two-level BSP", Method::Bsp, knobs),
        of("lazy grid", Method::LazyGrid, knobs),
        of("list", Method::List, knobs),
    ]
}

/// Wortel 2011, section 5.2.1, the list for Figure 5.8.
fn city(thesis: bool) -> Vec<Contender> {
    let split = Split::Quadrants;
    let pick = |published: TreeKnobs, tuned: TreeKnobs| if thesis { published } else { tuned };
    let four = divided(split, 10, if thesis { 2.0 } else { 4.0 });
    let mut all = vec![
        of("1", Method::One, pick(with(split, 10), with(split, 9))),
        of("2", Method::Two, pick(divided(split, 9, 2.0), divided(split, 9, 3.0))),
        of("3bR", Method::ThreeBR, pick(bucket(split, 168, 9), bucket(split, 8, 8))),
        of("3bR DR/OCL", Method::ThreeBR, bucket(split, 168, 9).reduced(pick_depth(thesis, 3, 6))),
        of("4", Method::Four, four),
        of("4 DR/OCL", Method::Four, four.reduced(pick_depth(thesis, 4, 6))),
    ];
    all.extend(beside(split));
    all
}

/// The same for Figure 5.6.
fn spheres(thesis: bool) -> Vec<Contender> {
    let split = Split::Octants;
    let pick = |published: TreeKnobs, tuned: TreeKnobs| if thesis { published } else { tuned };
    let radius = pick(bucket(split, 8, 7), bucket(split, 4, 7));
    let four = pick(divided(split, 6, 6.0), divided(split, 7, 2.0));
    let reduced = pick(radius, bucket(split, 168, 7));
    let mut all = vec![
        of("1", Method::One, pick(with(split, 8), with(split, 6))),
        of("2", Method::Two, pick(divided(split, 7, 3.0), divided(split, 9, 1.0))),
        of("3", Method::Three, pick(bucket(split, 2, 5), bucket(split, 8, 6))),
        of("3b", Method::ThreeB, pick(bucket(split, 2, 7), bucket(split, 4, 7))),
        of("3bR", Method::ThreeBR, radius),
        of("3bR DR/OCL", Method::ThreeBR, reduced.reduced(pick_depth(thesis, 3, 4))),
        of("4", Method::Four, four),
        of("4 DR/OCL", Method::Four, four.reduced(3)),
    ];
    all.extend(beside(split));
    all
}

fn pick_depth(thesis: bool, published: u8, tuned: u8) -> u8 {
    if thesis { published } else { tuned }
}

/// Depth reduction alone.
fn higher(knobs: TreeKnobs, depth_reduction: u8) -> TreeKnobs {
    TreeKnobs { depth_reduction, ..knobs }
}

fn leaves(knobs: TreeKnobs) -> TreeKnobs {
    TreeKnobs { leaf_boxes: true, ..knobs }
}

fn four(name: &'static str, knobs: TreeKnobs, loose: LooseKnobs) -> Contender {
    Contender { loose, ..of(name, Method::Four, knobs) }
}

const LARGEST: LooseKnobs = LooseKnobs { shrink: 0.5, largest: true };

fn beyond_city() -> Vec<Contender> {
    let split = Split::Quadrants;
    let slow = LooseKnobs { shrink: 0.6, largest: false };
    let mut all = vec![
        of("1 DR", Method::One, higher(with(split, 9), 8)),
        of("1 LB", Method::One, leaves(with(split, 9))),
        of("2 DR", Method::Two, higher(divided(split, 9, 4.0), 3)),
        of("2 LB", Method::Two, leaves(divided(split, 9, 3.0))),
        of("3bR LB", Method::ThreeBR, leaves(bucket(split, 8, 8))),
        four("4 sizes", divided(split, 10, 8.0), slow),
        four("4 largest", divided(split, 9, 3.0), LARGEST),
    ];
    all.extend(related(split, 16));
    all
}

fn beyond_spheres() -> Vec<Contender> {
    let split = Split::Octants;
    let slow = LooseKnobs { shrink: 0.6, largest: false };
    let mut all = vec![
        of("1 DR", Method::One, higher(with(split, 6), 6)),
        of("1 LB", Method::One, leaves(with(split, 6))),
        of("2 DR", Method::Two, higher(divided(split, 10, 1.0), 1)),
        of("2 LB", Method::Two, leaves(divided(split, 7, 1.0))),
        of("3 LB", Method::Three, leaves(bucket(split, 8, 6))),
        of("3b LB", Method::ThreeB, leaves(bucket(split, 1, 6))),
        of("3bR LB", Method::ThreeBR, leaves(bucket(split, 1, 6))),
        four("4 sizes", divided(split, 7, 6.0), slow),
        four("4 largest", divided(split, 7, 2.0), LARGEST),
    ];
    all.extend(related(split, 4));
    all
}

/// The indexes of the related work; the irregular tree parts nodes with more objects than `capacity`.
fn related(split: Split, capacity: u32) -> [Contender; 4] {
    let knobs = TreeKnobs::usual(split, 0);
    [
        of("irregular", Method::Irregular, bucket(split, capacity, 0)),
        of("regular grid", Method::RegularGrid, knobs),
        of("TBV grid", Method::TemporalGrid, knobs),
        of("TBV 1", Method::TemporalOctree, with(split, 4)),
    ]
}
