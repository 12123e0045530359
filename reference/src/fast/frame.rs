//! One call's units: what is drawn, where it is on the screen, and in which regions.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::bound::{Place, Projection};
use super::level::LANES;
use super::mesh::UNIT_CLUSTERS;
use super::wide::Wide;
use super::{Instance, Work};
use crate::draw::transform;
use crate::image::{REGION, Viewport};
use crate::window::Window;

/// Neighbouring clusters of one instance.
pub(crate) struct Unit {
    pub(crate) instance: u32,
    pub(crate) first_cluster: u32,
    /// One a cluster.
    pub(crate) places: Vec<Place>,
    /// Triangles of the clusters whose place is wide.
    pub(crate) wide: Vec<Wide>,
    /// Pixels that hold it; none where `min` is above `max`.
    pub(crate) min: [i16; 2],
    pub(crate) max: [i16; 2],
    /// Bits of a depth that none of its fragments is nearer than.
    pub(crate) near: u32,
}

/// Everything that regions read.
pub(crate) struct Frame<'a> {
    pub(crate) instances: &'a [Instance<'a>],
    pub(crate) units: Vec<Unit>,
    pub(crate) half: [f32; 2],
    /// Whether clusters that are strictly behind are left out.
    pub(crate) skips: bool,
}

/// Units that one task projects.
const UNITS_PER_TASK: usize = 64;

impl<'a> Frame<'a> {
    /// Projects all clusters and sets up the triangles of the wide ones.
    pub(crate) fn new(
        level: Level,
        viewport: Viewport,
        instances: &'a [Instance<'a>],
        skips: bool,
    ) -> (Self, Work) {
        let names: Vec<(u32, u32)> = instances
            .iter()
            .enumerate()
            .flat_map(|(i, instance)| {
                let clusters = instance.mesh.clusters.len() as u32;
                (0..clusters).step_by(UNIT_CLUSTERS).map(move |first| (i as u32, first))
            })
            .collect();
        let project = |&(instance, first): &(u32, u32)| {
            let of = &instances[instance as usize];
            dispatch!(level, s => Unit::new(s, viewport, of, instance, first))
        };
        let units: Vec<Unit> = names.par_iter().with_min_len(UNITS_PER_TASK).map(project).collect();
        let work = units.iter().fold(Work::default(), |work, unit| work + unit.work(instances));
        let half = [viewport.width as f32 * 0.5, viewport.height as f32 * 0.5];
        (Self { instances, units, half, skips }, work)
    }

    /// For each region the keys of its units, sorted: bits of the nearest depth, then the unit.
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

impl Unit {
    #[inline(always)]
    fn new<S: Simd>(
        s: S,
        viewport: Viewport,
        instance: &Instance<'_>,
        number: u32,
        first: u32,
    ) -> Self {
        let mesh = instance.mesh;
        let projection = Projection::new(viewport, instance.clip_from_object, mesh.reach);
        let last = mesh.clusters.len().min(first as usize + UNIT_CLUSTERS);
        let mut unit = Self {
            instance: number,
            first_cluster: first,
            places: Vec::with_capacity(last - first as usize),
            wide: Vec::new(),
            min: [i16::MAX; 2],
            max: [i16::MIN; 2],
            near: u32::MAX,
        };
        for from in (first as usize..last).step_by(LANES) {
            let places = projection.clusters(s, mesh, from);
            unit.places.extend_from_slice(&places[..(last - from).min(LANES)]);
        }
        let window = Window::new(viewport);
        for i in 0..unit.places.len() {
            match unit.places[i] {
                Place::Outside => {}
                Place::Narrow { min, max, near } => unit.hold(min, max, near),
                Place::Wide => unit.set_up(viewport, &window, instance, first as usize + i),
            }
        }
        unit
    }

    fn hold(&mut self, min: [i16; 2], max: [i16; 2], near: u32) {
        self.min = [self.min[0].min(min[0]), self.min[1].min(min[1])];
        self.max = [self.max[0].max(max[0]), self.max[1].max(max[1])];
        self.near = self.near.min(near);
    }

    /// Transforms, clips and snaps the triangles of a cluster one by one, as `naive` does.
    #[cold]
    fn set_up(
        &mut self,
        viewport: Viewport,
        window: &Window,
        instance: &Instance<'_>,
        cluster: usize,
    ) {
        let mesh = instance.mesh;
        let cluster = mesh.clusters[cluster];
        let first = cluster.first_vertex as usize;
        let mut clip = [[0.0; 4]; super::mesh::CLUSTER_VERTICES];
        for (i, corner) in clip[..usize::from(cluster.vertices)].iter_mut().enumerate() {
            let position = [0, 1, 2].map(|axis| mesh.positions[axis][first + i]);
            *corner = transform(&instance.clip_from_object, position);
        }
        let first = cluster.first_triangle as usize;
        for i in first..first + usize::from(cluster.triangles) {
            let corners = [0, 1, 2].map(|corner| clip[usize::from(mesh.corners[corner][i])]);
            // Wholly before the near plane: nothing would be left. NaN fails every comparison.
            if corners.iter().all(|c| c[2] < 0.0) {
                continue;
            }
            let Some(polygon) = window.clipper.clip(corners) else { continue };
            let id = instance.first_draw + mesh.ranks[i] + 1;
            for triangle in window.fan(&polygon, instance.faces) {
                if let Some(wide) = Wide::new(triangle, id, viewport) {
                    self.hold(wide.min, wide.max, wide.near());
                    self.wide.push(wide);
                }
            }
        }
    }

    /// What projecting it took.
    fn work(&self, instances: &[Instance<'_>]) -> Work {
        let mesh = instances[self.instance as usize].mesh;
        let mut work = Work { units: 1, ..Work::default() };
        for (place, cluster) in
            self.places.iter().zip(&mesh.clusters[self.first_cluster as usize..])
        {
            match place {
                Place::Outside => work.clusters_outside += 1,
                Place::Narrow { .. } => work.clusters_narrow += 1,
                Place::Wide => {
                    work.clusters_wide += 1;
                    work.triangles += u64::from(cluster.triangles);
                }
            }
        }
        work
    }
}
