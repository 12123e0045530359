//! One call's units: what is drawn, where it is on the screen, and in which regions.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::bound::{Batch, Place, Projection};
use super::level::LANES;
use super::mesh::{CLUSTER_VERTICES, Cluster, UNIT_CLUSTERS};
use super::wide::Wide;
use super::{Instance, Work};
use crate::draw::{Faces, transform};
use crate::image::{REGION, Viewport};
use crate::order::DepthOrder;
use crate::window::{Oriented, Window, WindowVertex};

/// Neighbouring clusters of one instance.
pub(crate) struct Unit {
    pub(crate) instance: u32,
    pub(crate) first_cluster: u32,
    /// Which of the lists of [`Frame::lists`] has its places and triangles, and where there.
    list: u32,
    places: [u32; 2],
    wide: [u32; 2],
    /// Pixels that hold it; none where `min` is above `max`.
    pub(crate) min: [i16; 2],
    pub(crate) max: [i16; 2],
    /// The key of a depth that none of its fragments is nearer than.
    pub(crate) near: u32,
}

/// What the units of one task have.
#[derive(Default)]
struct Lists {
    /// One a cluster.
    places: Vec<Place>,
    /// Triangles of the clusters whose place is wide.
    wide: Vec<Wide>,
}

/// Everything that regions read.
pub(crate) struct Frame<'a> {
    pub(crate) instances: &'a [Instance<'a>],
    pub(crate) units: Vec<Unit>,
    lists: Vec<Lists>,
    pub(crate) half: [f32; 2],
    /// Whether clusters that are strictly behind are left out.
    pub(crate) skips: bool,
}

/// Units that one task projects.
const UNITS_PER_TASK: usize = 256;

/// The units (instance, first cluster) of the instances.
pub(crate) fn names(instances: &[Instance<'_>]) -> Vec<(u32, u32)> {
    let mut names = Vec::new();
    for (i, instance) in instances.iter().enumerate() {
        let clusters = instance.mesh.clusters.len() as u32;
        names.extend((0..clusters).step_by(UNIT_CLUSTERS).map(|first| (i as u32, first)));
    }
    names
}

impl<'a> Frame<'a> {
    /// Projects all clusters of the units and sets up the triangles of the wide ones; without vectors
    /// all are wide.
    pub(crate) fn new(
        level: Option<Level>,
        (viewport, order): (Viewport, DepthOrder),
        instances: &'a [Instance<'a>],
        names: &[(u32, u32)],
        skips: bool,
    ) -> (Self, Work) {
        let project = |names: &[(u32, u32)]| {
            let mut task = Task::new(viewport, order, instances);
            match level {
                Some(level) => dispatch!(level, s => task.project(s, names)),
                None => task.all_wide(names),
            }
            task
        };
        // One task's share is not worth another thread's attention.
        let tasks: Vec<Task<'_>> = if names.len() <= UNITS_PER_TASK {
            vec![project(names)]
        } else {
            names.par_chunks(UNITS_PER_TASK).map(project).collect()
        };
        let half = [viewport.width as f32 * 0.5, viewport.height as f32 * 0.5];
        let mut frame = Self {
            instances,
            units: Vec::with_capacity(names.len()),
            lists: Vec::with_capacity(tasks.len()),
            half,
            skips,
        };
        let mut work = Work::default();
        for task in tasks {
            work = work + task.work;
            let list = frame.lists.len() as u32;
            frame.units.extend(task.units.into_iter().map(|unit| Unit { list, ..unit }));
            frame.lists.push(task.lists);
        }
        (frame, work)
    }

    /// Clusters of all units.
    pub(crate) fn clusters(&self) -> usize {
        self.lists.iter().map(|list| list.places.len()).sum()
    }

    /// One a cluster of the unit.
    pub(crate) fn places(&self, unit: &Unit) -> &[Place] {
        &self.lists[unit.list as usize].places[range(unit.places)]
    }

    /// Triangles of the unit's wide clusters.
    pub(crate) fn wide(&self, unit: &Unit) -> &[Wide] {
        &self.lists[unit.list as usize].wide[range(unit.wide)]
    }

    /// For each region the keys of its units, not sorted: the key of the nearest depth, then the unit.
    pub(crate) fn regions(&self, viewport: Viewport) -> Vec<Vec<u64>> {
        let across = (viewport.width as usize).div_ceil(REGION);
        let down = (viewport.height as usize).div_ceil(REGION);
        let mut regions = vec![Vec::new(); across * down];
        for (i, unit) in self.units.iter().enumerate() {
            if unit.min[0] > unit.max[0] || unit.min[1] > unit.max[1] {
                continue;
            }
            let region = |pixel: i16, most: usize| (pixel.max(0) as usize / REGION).min(most - 1);
            let key = u64::from(unit.near) << 32 | i as u64;
            for row in region(unit.min[1], down)..=region(unit.max[1], down) {
                for column in region(unit.min[0], across)..=region(unit.max[0], across) {
                    regions[row * across + column].push(key);
                }
            }
        }
        regions
    }
}

fn range([from, to]: [u32; 2]) -> Range<usize> {
    from as usize..to as usize
}

/// Some units on one thread.
struct Task<'a> {
    instances: &'a [Instance<'a>],
    viewport: Viewport,
    order: DepthOrder,
    window: Window,
    projection: Projection,
    batch: Batch,
    units: Vec<Unit>,
    lists: Lists,
    work: Work,
}

impl<'a> Task<'a> {
    fn new(viewport: Viewport, order: DepthOrder, instances: &'a [Instance<'a>]) -> Self {
        Self {
            instances,
            viewport,
            order,
            window: Window::new(viewport, order),
            projection: Projection::new(viewport, order),
            batch: Batch::new(),
            units: Vec::new(),
            lists: Lists::default(),
            work: Work::default(),
        }
    }

    /// Units (instance, first cluster) one after the other; as many that have one cluster as fit go
    /// through the projection together.
    #[inline(always)]
    fn project<S: Simd>(&mut self, s: S, names: &[(u32, u32)]) {
        let mut rest = names;
        while let [(instance, first), ..] = *rest {
            let mesh = self.instances[instance as usize].mesh;
            let clusters = (mesh.clusters.len() - first as usize).min(UNIT_CLUSTERS);
            let mut taken = 1;
            let from = self.lists.places.len() as u32;
            if clusters == 1 {
                let single =
                    |name: &&(u32, u32)| self.instances[name.0 as usize].mesh.clusters.len() == 1;
                // One cluster may also be what is left of a larger mesh.
                taken = rest.iter().take(LANES).take_while(single).count().max(1);
                for (lane, &(instance, first)) in rest[..taken].iter().enumerate() {
                    self.load(instance, first as usize, lane..lane + 1);
                }
                let places = self.projection.clusters(s, &self.batch);
                self.lists.places.extend_from_slice(&places[..taken]);
            } else {
                for at in (0..clusters).step_by(LANES) {
                    let count = (clusters - at).min(LANES);
                    self.load(instance, first as usize + at, 0..count);
                    let places = self.projection.clusters(s, &self.batch);
                    self.lists.places.extend_from_slice(&places[..count]);
                }
            }
            for (i, &(instance, first)) in rest[..taken].iter().enumerate() {
                let from = from + i as u32;
                self.unit(instance, first, [from, from + clusters as u32]);
            }
            rest = &rest[taken..];
        }
    }

    /// Units whose clusters' places are not asked for.
    fn all_wide(&mut self, names: &[(u32, u32)]) {
        for &(instance, first) in names {
            let mesh = self.instances[instance as usize].mesh;
            let from = self.lists.places.len();
            let to = from + (mesh.clusters.len() - first as usize).min(UNIT_CLUSTERS);
            self.lists.places.resize(to, Place::Wide);
            self.unit(instance, first, [from as u32, to as u32]);
        }
    }

    /// Puts clusters of one instance, from `first` on, into lanes.
    #[inline(always)]
    fn load(&mut self, instance: u32, first: usize, lanes: Range<usize>) {
        let instance = &self.instances[instance as usize];
        for (row, &element) in self.batch.matrix.iter_mut().zip(&instance.clip_from_object) {
            row[lanes.clone()].fill(element);
        }
        for (row, bounds) in self.batch.boxes.iter_mut().zip(&instance.mesh.boxes) {
            row[lanes.clone()].copy_from_slice(&bounds[first..first + lanes.len()]);
        }
    }

    fn unit(&mut self, instance: u32, first: u32, places: [u32; 2]) {
        let wide = self.lists.wide.len() as u32;
        let mut unit = Unit {
            instance,
            first_cluster: first,
            list: 0,
            places,
            wide: [wide, wide],
            min: [i16::MAX; 2],
            max: [i16::MIN; 2],
            near: u32::MAX,
        };
        self.work.units += 1;
        for (i, place) in range(places).enumerate() {
            match self.lists.places[place] {
                Place::Outside => self.work.clusters_outside += 1,
                Place::Narrow { min, max, near } => {
                    self.work.clusters_narrow += 1;
                    unit.hold(min, max, near);
                }
                Place::Wide => {
                    let instance = &self.instances[instance as usize];
                    let cluster = instance.mesh.clusters[first as usize + i];
                    self.work.clusters_wide += 1;
                    self.work.triangles += u64::from(cluster.triangles);
                    self.set_up(instance, cluster);
                }
            }
        }
        unit.wide[1] = self.lists.wide.len() as u32;
        for wide in &self.lists.wide[range(unit.wide)] {
            unit.hold(wide.min, wide.max, wide.near(self.order));
        }
        self.units.push(unit);
    }

    /// Transforms, clips and snaps the triangles of a cluster one by one, as `naive` does; a vertex of
    /// triangles that no plane cuts is snapped once, which gives the same bits.
    #[inline(never)]
    fn set_up(&mut self, instance: &Instance<'_>, cluster: Cluster) {
        let view = instance.mesh.view(cluster);
        let corners = Corners::new(&self.window, instance, cluster);
        for i in 0..usize::from(cluster.triangles) {
            let at = view.triangle(i);
            let [a, b, c] = at.map(|corner| corners.outside[corner]);
            // Wholly before the near plane: nothing would be left.
            if a & b & c & 1 != 0 {
                continue;
            }
            let id = instance.first_draw + view.ranks[i] + 1;
            if a | b | c == 0 {
                let whole = Oriented::new(at.map(|corner| corners.snapped[corner]), instance.faces);
                self.push(whole, id);
            } else {
                let clip = at.map(|corner| corners.clip[corner]);
                self.push_clipped(clip, instance.faces, id);
            }
        }
    }

    fn push(&mut self, triangle: Option<Oriented>, id: u32) {
        self.lists.wide.extend(triangle.and_then(|t| Wide::new(t, id, self.viewport)));
    }

    fn push_clipped(&mut self, clip: [[f32; 4]; 3], faces: Faces, id: u32) {
        if let Some(polygon) = self.window.clipper.clip(clip) {
            let fan = self.window.fan(&polygon, faces);
            self.lists.wide.extend(fan.filter_map(|t| Wide::new(t, id, self.viewport)));
        }
    }
}

impl Unit {
    fn hold(&mut self, min: [i16; 2], max: [i16; 2], near: u32) {
        self.min = [self.min[0].min(min[0]), self.min[1].min(min[1])];
        self.max = [self.max[0].max(max[0]), self.max[1].max(max[1])];
        self.near = self.near.min(near);
    }
}

/// Vertices of one cluster.
struct Corners {
    clip: [[f32; 4]; CLUSTER_VERTICES],
    /// A bit for each plane that the vertex is beyond, the lowest for near, and one more where it does
    /// not project.
    outside: [u8; CLUSTER_VERTICES],
    /// Only where nothing is outside.
    snapped: [WindowVertex; CLUSTER_VERTICES],
}

impl Corners {
    fn new(window: &Window, instance: &Instance<'_>, cluster: Cluster) -> Self {
        let none = WindowVertex { x: 0, y: 0, z: 0.0 };
        let mut corners = Self {
            clip: [[0.0; 4]; CLUSTER_VERTICES],
            outside: [0; CLUSTER_VERTICES],
            snapped: [none; CLUSTER_VERTICES],
        };
        let view = instance.mesh.view(cluster);
        for i in 0..usize::from(cluster.vertices) {
            let clip = transform(&instance.clip_from_object, view.position(i));
            corners.clip[i] = clip;
            corners.outside[i] = window.clipper.outside(clip);
            if corners.outside[i] == 0 {
                corners.snapped[i] = window.vertex(clip);
            }
        }
        corners
    }
}
