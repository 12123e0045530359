//! Shrinking: from a world in which something fails to the smallest that still does, by leaving things
//! out: frames before and after, views, objects, effects, triangles. Chunks are left out by halves
//! (Zeller & Hildebrandt 2002, *Simplifying and isolating failure-inducing input*); what is left is no
//! longer seeded, but a scene that stands alone.

use std::sync::Arc;

use crate::effect::EFFECTS;
use crate::scene::{Limb, Mesh, Object, Scene};

/// Rounds over all that can be left out, at most; one that leaves nothing more out ends it.
const ROUNDS: u32 = 6;

/// Says in which frame a scene fails first; `None` where it holds.
pub type FirstFailure<'a> = dyn FnMut(&Scene) -> Option<u32> + 'a;

/// A scene made smaller.
#[derive(Clone, Debug)]
pub struct Shrunk {
    /// It fails like the one that it was made from.
    pub scene: Scene,
    /// Scenes that were tried.
    pub tried: u32,
}

/// How a scene is measured against another: objects, frames, triangles.
#[must_use]
pub fn size(scene: &Scene) -> (usize, u32, u64) {
    (scene.objects.len(), scene.frames, scene.triangle_count())
}

/// Makes `scene` smaller while it fails; `fails` may give up in time by saying that a scene holds. `None`
/// where the scene does not fail at all.
pub fn shrink(scene: &Scene, fails: &mut FirstFailure<'_>) -> Option<Shrunk> {
    let mut work = Work { scene: scene.clone(), fails, tried: 0 };
    let whole = work.scene.clone();
    if !work.takes(whole) {
        return None;
    }
    for _ in 0..ROUNDS {
        let before = size(&work.scene);
        work.leave_out_frames();
        work.leave_out_objects();
        work.leave_out_effects();
        work.leave_out_views();
        work.leave_out_frames();
        work.leave_out_triangles();
        if size(&work.scene) == before {
            break;
        }
    }
    Some(Shrunk { scene: work.scene, tried: work.tried })
}

struct Work<'a, 'b> {
    scene: Scene,
    fails: &'a mut FirstFailure<'b>,
    tried: u32,
}

impl Work<'_, '_> {
    /// Goes on with `scene` if it fails, cut after its first failing frame.
    fn takes(&mut self, scene: Scene) -> bool {
        self.tried += 1;
        let Some(frame) = (self.fails)(&scene) else { return false };
        let frames = scene.frames.min(frame + 1);
        self.scene = Scene { frames, ..scene };
        true
    }

    /// The last frames alone: one, two, four …
    fn leave_out_frames(&mut self) {
        let mut kept = 1;
        while kept < self.scene.frames {
            let start = self.scene.start + self.scene.frames - kept;
            if self.takes(Scene { start, frames: kept, ..self.scene.clone() }) {
                return;
            }
            kept *= 2;
        }
    }

    fn leave_out_objects(&mut self) {
        let mut size = self.scene.objects.len().div_ceil(2);
        while size > 0 {
            let mut first = 0;
            while first < self.scene.objects.len() {
                let without = |place: usize| !(first..first + size).contains(&place);
                let smaller = with_objects(&self.scene, without);
                if smaller.objects.is_empty() || !self.takes(smaller) {
                    first += size;
                }
            }
            size /= 2;
        }
    }

    fn leave_out_effects(&mut self) {
        for effect in EFFECTS.iter().rev() {
            if (effect.declared)(&self.scene) {
                let mut still = self.scene.clone();
                (effect.take_out)(&mut still);
                self.takes(still);
            }
        }
        // Then each by itself.
        let count = |scene: &Scene| {
            let effects = &scene.effects;
            let jumpers = effects.teleport.as_ref().map_or(0, |teleport| teleport.jumpers.len());
            let figures = effects.articulated.as_ref().map_or(0, |all| all.figures.len());
            (effects.motion.as_ref().map_or(0, |motion| motion.movers.len()), jumpers, figures)
        };
        for place in (0..count(&self.scene).2).rev() {
            let mut still = self.scene.clone();
            still.effects.articulated.iter_mut().for_each(|all| drop(all.figures.remove(place)));
            self.takes(still);
        }
        for place in (0..count(&self.scene).0).rev() {
            let mut still = self.scene.clone();
            still.effects.motion.iter_mut().for_each(|motion| drop(motion.movers.remove(place)));
            self.takes(still);
        }
        for place in (0..count(&self.scene).1).rev() {
            let mut still = self.scene.clone();
            let teleport = still.effects.teleport.iter_mut();
            teleport.for_each(|teleport| drop(teleport.jumpers.remove(place)));
            self.takes(still);
        }
    }

    fn leave_out_views(&mut self) {
        for view in 0..self.scene.cameras.len() {
            if self.scene.cameras.len() > 1 {
                let camera = self.scene.cameras[view].clone();
                if self.takes(Scene { cameras: vec![camera], ..self.scene.clone() }) {
                    return;
                }
            }
        }
    }

    fn leave_out_triangles(&mut self) {
        for mesh in 0..self.scene.meshes.len() {
            let mut size = self.scene.meshes[mesh].triangles().len().div_ceil(2);
            while size > 0 {
                let mut first = 0;
                while first < self.scene.meshes[mesh].triangles().len() {
                    let without = |place: usize| !(first..first + size).contains(&place);
                    let smaller = with_triangles(&self.scene, mesh, without);
                    if smaller.meshes[mesh].triangles().is_empty() || !self.takes(smaller) {
                        first += size;
                    }
                }
                size /= 2;
            }
        }
    }
}

/// The scene with the objects whose place `keeps` says, and the meshes that these need.
fn with_objects(scene: &Scene, keeps: impl Fn(usize) -> bool) -> Scene {
    let mut number = Vec::new();
    let (mut objects, mut meshes) = (Vec::new(), Vec::new());
    let mut mesh_number = vec![None; scene.meshes.len()];
    for (place, object) in scene.objects.iter().enumerate() {
        number.push(keeps(place).then_some(objects.len() as u32));
        if keeps(place) {
            let mesh = *mesh_number[object.mesh as usize].get_or_insert_with(|| {
                meshes.push(Arc::clone(&scene.meshes[object.mesh as usize]));
                meshes.len() as u32 - 1
            });
            objects.push(Object { mesh, ..*object });
        }
    }
    let mut effects = scene.effects.clone();
    if let Some(motion) = &mut effects.motion {
        let kept = motion.movers.drain(..);
        let kept = kept.filter_map(|(object, path)| Some((number[object as usize]?, path)));
        motion.movers = kept.collect();
    }
    if let Some(articulated) = &mut effects.articulated {
        for figure in &mut articulated.figures {
            let kept = figure.limbs.drain(..);
            let kept = kept
                .filter_map(|limb| Some(Limb { object: number[limb.object as usize]?, ..limb }));
            figure.limbs = kept.collect();
        }
        articulated.figures.retain(|figure| !figure.limbs.is_empty());
    }
    if let Some(teleport) = &mut effects.teleport {
        let kept = teleport.jumpers.drain(..);
        let kept = kept.filter_map(|(object, jumps)| Some((number[object as usize]?, jumps)));
        teleport.jumpers = kept.collect();
    }
    effects.motion = effects.motion.filter(|motion| !motion.movers.is_empty());
    effects.articulated = effects.articulated.filter(|all| !all.figures.is_empty());
    effects.teleport = effects.teleport.filter(|teleport| !teleport.jumpers.is_empty());
    Scene { objects, meshes, effects, ..scene.clone() }
}

/// The scene with those triangles of one mesh, and the vertices that they need.
fn with_triangles(scene: &Scene, mesh: usize, keeps: impl Fn(usize) -> bool) -> Scene {
    let old = &scene.meshes[mesh];
    let mut number = vec![None; old.positions().len()];
    let mut positions = Vec::new();
    let kept = old.triangles().iter().enumerate().filter(|(place, _)| keeps(*place));
    let triangles = kept
        .map(|(_, triangle)| {
            triangle.map(|vertex| {
                *number[vertex as usize].get_or_insert_with(|| {
                    positions.push(old.positions()[vertex as usize]);
                    positions.len() as u32 - 1
                })
            })
        })
        .collect();
    let new = Mesh::new(old.name(), positions, triangles).expect("a part of a sound mesh is sound");
    let mut meshes = scene.meshes.clone();
    meshes[mesh] = Arc::new(new);
    Scene { meshes, ..scene.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::{Knobs, SWARM, build};

    fn scene(seed: u64) -> Scene {
        build(SWARM.name, &Knobs { seed: Some(seed), ..Knobs::default() }).unwrap()
    }

    /// A failure that needs two objects, one of them moving, and frame 7: nothing else is left.
    #[test]
    fn only_what_a_failure_needs_is_left() {
        let found = (0..).map(scene).find(|scene| {
            let movers = scene.effects.motion.as_ref().map_or(0, |motion| motion.movers.len());
            movers > 3 && scene.objects.len() > 40 && scene.effects.teleport.is_some()
        });
        let scene = found.unwrap();
        let names = |scene: &Scene, place: usize| scene.objects[place].placement.translation;
        let mover = scene.effects.motion.as_ref().unwrap().movers[2].0 as usize;
        let (one, other) = (names(&scene, mover), names(&scene, (mover + 9) % scene.objects.len()));
        let mut fails = |scene: &Scene| {
            let place = |wanted| (0..scene.objects.len()).find(|&o| names(scene, o) == wanted);
            let moving = place(one)?;
            place(other)?;
            let movers = &scene.effects.motion.as_ref()?.movers;
            movers.iter().find(|(object, _)| *object as usize == moving)?;
            let last = scene.start + scene.frames;
            (last > 7 && scene.start <= 7).then_some(7 - scene.start)
        };
        let shrunk = shrink(&scene, &mut fails).unwrap();
        assert_eq!(size(&shrunk.scene).0, 2);
        assert_eq!((shrunk.scene.start, shrunk.scene.frames), (7, 1));
        assert!(shrunk.scene.effects.teleport.is_none() && shrunk.scene.cameras.len() == 1);
        // One triangle a mesh, of at most two meshes.
        assert!(size(&shrunk.scene).2 <= 2, "{:?}", size(&shrunk.scene));
        assert_eq!(shrunk.scene.effects.motion.unwrap().movers.len(), 1);
        assert!(shrink(&scene, &mut |_| None).is_none(), "a world that holds");
    }
}
