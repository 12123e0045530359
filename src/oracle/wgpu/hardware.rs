//! The oracle itself: a command stream of draws and questions, sent in batches.

use std::collections::VecDeque;
use std::sync::Arc;

use plainsight_reference::Tolerance;

use super::images::Images;
use super::pyramid::{Ask, Pyramid};
use super::read_back::{DepthReader, MOST_COPIES};
use super::redraw::encode_redraw;
use super::scene_size::{Binned, Filling, Reach, question_bytes};
use super::slot::{Need, RESULT_BYTES, Slot, set_bytes};
use super::stage::{DrawnObject, GpuParts, GpuStage};
use crate::oracle::{
    Answer, DeviceLimits, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, Questions,
    ReadBack, Residency, Stage, Step, box_proxy_triangles, hull_proxy_triangles,
    rectangle_triangles,
};
use crate::part::{ObjectId, PartId};

/// One thing to do, in the order it was said.
#[derive(Clone, Copy)]
enum Event {
    Draw(PartId),
    /// A question with its run of proxy vertices.
    Ask {
        first_vertex: u32,
        end_vertex: u32,
    },
    /// A question with its run of rectangles for the pyramid.
    AskPyramid {
        first: u32,
        end: u32,
    },
}

/// A batch on its way.
struct Flight {
    slot: Option<Slot>,
    /// Depth on its way back, with what it is to answer.
    depth: Option<(wgpu::Buffer, Vec<Ask>)>,
    /// Answers already taken from it.
    early: Vec<Answer>,
    submission: wgpu::SubmissionIndex,
    queries: Vec<QueryId>,
    /// Places in `queries` that are visible whatever the device says.
    unasked: Vec<u32>,
    /// Whether the batch goes on in the next flight.
    more: bool,
}

/// The meshes of a device with limited memory.
struct Limited {
    residency: Residency,
    /// By mesh; what the books call resident.
    meshes: Vec<Option<GpuParts>>,
    /// Meshes of draws that the device may not have done yet.
    in_use: Vec<bool>,
}

/// Occlusion queries of a Vulkan device.
pub struct Hardware {
    stage: Arc<GpuStage>,
    images: Images,
    redraw_images: Option<Images>,
    /// Clip from each object.
    matrices: Vec<[f32; 16]>,
    cleared: bool,
    asked: u32,
    events: Vec<Event>,
    open: Vec<QueryId>,
    proxy_vertices: Vec<[f32; 4]>,
    questions: Questions,
    /// Answers rectangles where query objects do not.
    pyramid: Option<Pyramid>,
    reader: DepthReader,
    asks: Vec<Ask>,
    /// Questions of the batch that are answered "visible" without the device.
    unasked: Vec<u32>,
    flights: VecDeque<Flight>,
    free: Vec<Slot>,
    queries_per_pass: usize,
    /// What the next submission holds so far, where the device's questions need that to be little.
    filling: Option<Filling>,
    submissions: u64,
    limited: Option<Limited>,
    /// What went wrong while drawing, told by the next submit. Until then nothing more is drawn: the
    /// books no longer say what is on the device.
    failed: Option<OracleError>,
}

impl Hardware {
    /// An oracle with targets of its own over shared geometry, and the limits of its driver.
    ///
    /// # Errors
    /// [`OracleError::Lost`] where the device refuses.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    pub fn new(stage: &Arc<GpuStage>, questions: Questions) -> Result<Self, OracleError> {
        Self::with_limits(stage, questions, DeviceLimits::default())
    }

    /// An oracle like [`Hardware::new`]'s that sends no more at once than `limits` say. Answers do not depend
    /// on them. Only query objects are limited: [`Questions::Pyramid`] and [`Questions::ReadBack`] have none.
    ///
    /// # Errors
    /// [`OracleError::Lost`] where the device refuses.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    pub fn with_limits(
        stage: &Arc<GpuStage>,
        questions: Questions,
        limits: DeviceLimits,
    ) -> Result<Self, OracleError> {
        let scene_bytes = limits.scene_bytes.or(stage.gpu.scene_bytes());
        let filling = scene_bytes
            .filter(|_| questions == Questions::Queries)
            .map(|bytes| Filling::new(bytes, stage.stage.viewport));
        let images = Images::new(stage, false);
        let pyramid = (questions == Questions::Pyramid)
            .then(|| Pyramid::new(&stage.gpu, stage.stage.viewport));
        let limited = stage.stage.memory.map(|knobs| {
            let partition = &stage.stage.partition;
            let count = partition.meshes().len();
            let residency = Residency::new(partition, knobs);
            let meshes = (0..count).map(|_| None).collect();
            Limited { residency, meshes, in_use: vec![false; count] }
        });
        stage.gpu.healthy()?;
        Ok(Self {
            stage: Arc::clone(stage),
            images,
            redraw_images: None,
            matrices: Vec::new(),
            cleared: false,
            asked: 0,
            events: Vec::new(),
            open: Vec::new(),
            proxy_vertices: Vec::new(),
            questions,
            pyramid,
            reader: DepthReader::default(),
            asks: Vec::new(),
            unasked: Vec::new(),
            flights: VecDeque::new(),
            free: Vec::new(),
            queries_per_pass: limits.queries_per_pass.clamp(1, DeviceLimits::MOST_QUERIES),
            filling,
            submissions: 0,
            limited,
            failed: None,
        })
    }

    /// Submissions to the device so far, but for images that were read back.
    #[must_use]
    pub fn submissions(&self) -> u64 {
        self.submissions
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.stage.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// A matrix to clip space whose depth runs as the device's does, from 0 to w.
    fn on_device(&self, matrix: &[f32; 16]) -> [f32; 16] {
        let (mut turned, order) = (*matrix, self.stage.stage.depth);
        turned.iter_mut().skip(2).step_by(4).for_each(|z| *z = order.on_device(*z));
        turned
    }

    /// What the shader is told of an object.
    fn drawn_object(&self, object: ObjectId) -> DrawnObject {
        DrawnObject {
            clip_from_object: self.on_device(&self.matrices[object.0 as usize]),
            first_part: self.stage.stage.partition.first_part(object).0,
            padding: [0; 3],
        }
    }

    /// The buffers that parts of a mesh are drawn from.
    fn parts(&self, mesh: u32) -> &GpuParts {
        match &self.limited {
            None => &self.stage.meshes[mesh as usize].parts,
            Some(limited) => {
                limited.meshes[mesh as usize].as_ref().expect("what is drawn was loaded")
            }
        }
    }

    /// Sees to it that a mesh is resident before it is drawn.
    fn need(&mut self, mesh: u32) -> Result<(), OracleError> {
        let Some(limited) = &mut self.limited else { return Ok(()) };
        let mut steps = Vec::new();
        limited.residency.need(mesh, &mut steps);
        self.carry_out(&steps)?;
        // Only now: what had to be drawn first did not use it.
        if let Some(limited) = &mut self.limited {
            limited.in_use[mesh as usize] = true;
        }
        Ok(())
    }

    /// Sees to it that a part can be drawn at this point of the stream.
    fn before_draw(&mut self, part: PartId) -> Result<(), OracleError> {
        // Questions so far are about the depth before this draw.
        if self.questions == Questions::ReadBack && !self.open.is_empty() {
            self.flush(true)?;
        }
        let partition = &self.stage.stage.partition;
        let mesh = partition.mesh_index(partition.locate(part).0);
        self.need(mesh)?;
        self.make_room(Binned::Draw, |this| this.draw_bytes(part))
    }

    /// Bytes of a draw in the device's scene, by an upper estimate.
    fn draw_bytes(&self, part: PartId) -> u64 {
        let Stage { partition, viewport, .. } = &self.stage.stage;
        let (object, local) = partition.locate(part);
        let clip = self.on_device(&self.matrices[object.0 as usize]);
        let shape = &self.stage.shapes()[partition.mesh_index(object) as usize][local as usize];
        let bounds = &partition.mesh(object).parts[local as usize].bounds;
        shape.draw_bytes(bounds, &clip, *viewport)
    }

    /// Bytes of a question in the device's scene, by an upper estimate.
    fn question_bytes(&self, proxies: &[Proxy]) -> u64 {
        let viewport = self.stage.stage.viewport;
        let reach = |proxy: &Proxy| match *proxy {
            Proxy::Rectangle { min, max, .. } => (Reach::within(min, max, viewport), 2),
            Proxy::Hull { hull, min, max, .. } => {
                (Reach::within(min, max, viewport), hull.corners().len() as u64)
            }
            Proxy::Box { clip_from_box, min, max } => {
                let clip = self.on_device(&clip_from_box);
                let [min, max] = [min, max].map(|corner| corner.map(f64::from));
                (Reach::of_box(&clip, min, max, viewport), 12)
            }
        };
        question_bytes(proxies.iter().map(reach), viewport)
    }

    /// Sends what is there where it would be too much together with an event of so many bytes, which is to
    /// follow.
    fn make_room(
        &mut self,
        event: Binned,
        bytes: impl Fn(&Self) -> u64,
    ) -> Result<(), OracleError> {
        if self.filling.is_none() {
            return Ok(());
        }
        let bytes = bytes(self);
        if self.filling.as_ref().is_some_and(|filling| filling.is_full_for(event, bytes)) {
            self.flush(true)?;
        }
        if let Some(filling) = &mut self.filling {
            filling.add(event, bytes);
        }
        Ok(())
    }

    /// Throws meshes out and loads others. What is still to be drawn with the former is drawn first,
    /// and waited for: only then does the device give their memory back.
    fn carry_out(&mut self, steps: &[Step]) -> Result<(), OracleError> {
        for step in steps {
            let Some(limited) = &mut self.limited else { break };
            match *step {
                Step::Evict(mesh) => {
                    if limited.in_use[mesh as usize] {
                        if !self.events.is_empty() {
                            self.flush(true)?;
                        }
                        let last = self.flights.back().map(|flight| flight.submission.clone());
                        self.stage.gpu.wait(last)?;
                        self.all_done();
                    }
                    self.throw_out(mesh);
                }
                Step::Load(mesh) => {
                    let partition = &self.stage.stage.partition;
                    let parts = &partition.meshes()[mesh as usize];
                    let loaded = GpuParts::new(&self.stage.gpu.device, parts);
                    limited.meshes[mesh as usize] = Some(loaded);
                }
            }
        }
        Ok(())
    }

    fn throw_out(&mut self, mesh: u32) {
        let Some(limited) = &mut self.limited else { return };
        if let Some(parts) = limited.meshes[mesh as usize].take() {
            parts.destroy();
        }
    }

    /// Makes room for one more copy of the depth target: lands the oldest where there are too many.
    fn spare_a_copy(&mut self) -> Result<(), OracleError> {
        let mut flying = (0..self.flights.len()).filter(|&i| self.flights[i].depth.is_some());
        let oldest = flying.next();
        if flying.count() + 1 >= MOST_COPIES
            && let Some(oldest) = oldest
        {
            self.stage.gpu.wait(Some(self.flights[oldest].submission.clone()))?;
            let mut early = Vec::new();
            let flight = &mut self.flights[oldest];
            let (depth, queries) = (flight.depth.take(), std::mem::take(&mut flight.queries));
            let unasked = std::mem::take(&mut flight.unasked);
            if let Some(depth) = depth {
                self.answer_from_depth(depth, &queries, &unasked, &mut early)?;
            }
            self.flights[oldest].early = early;
        }
        Ok(())
    }

    /// Answers the questions of a flight from its depth, which has arrived.
    fn answer_from_depth(
        &mut self,
        (copy, asks): (wgpu::Buffer, Vec<Ask>),
        queries: &[QueryId],
        unasked: &[u32],
        answers: &mut Vec<Answer>,
    ) -> Result<(), OracleError> {
        let mut shows = vec![false; queries.len()];
        unasked.iter().for_each(|&place| shows[place as usize] = true);
        self.reader.answer(&self.images, copy, &asks, &mut shows)?;
        let answer = |(&query, visible)| Answer { query, visible };
        answers.extend(queries.iter().zip(shows).map(answer));
        Ok(())
    }

    /// No draw is on its way to the device any more.
    fn all_done(&mut self) {
        if let Some(limited) = &mut self.limited {
            limited.in_use.fill(false);
        }
    }

    /// Sends everything since the last flush to the device. `more`: the batch is not yet ended.
    fn flush(&mut self, more: bool) -> Result<(), OracleError> {
        let reads_back = self.questions == Questions::ReadBack && !self.open.is_empty();
        if reads_back {
            self.spare_a_copy()?;
        }
        let mut encoder = self.encoder();
        let slot = (!self.open.is_empty() && !reads_back).then(|| self.slot());
        if let Some(slot) = &slot {
            let queue = &self.stage.gpu.queue;
            if self.pyramid.is_some() {
                queue.write_buffer(&slot.proxies, 0, bytemuck::cast_slice(&self.asks));
                encoder.clear_buffer(&slot.resolved, 0, None);
            } else {
                queue.write_buffer(&slot.proxies, 0, bytemuck::cast_slice(&self.proxy_vertices));
            }
        }
        let (mut place, mut set) = (0, 0);
        while place < self.events.len() || !self.cleared {
            if let (true, Some(Event::AskPyramid { .. }), Some(slot), Some(pyramid)) =
                (self.cleared, self.events.get(place), &slot, &self.pyramid)
            {
                place = self.encode_pyramid(&mut encoder, slot, pyramid, place);
                continue;
            }
            let clear = !std::mem::replace(&mut self.cleared, true);
            // Draws after the last question of a full set go with the next pass, which may have none.
            let with = slot.as_ref().filter(|_| {
                self.pyramid.is_none() && set * self.queries_per_pass < self.open.len()
            });
            place = self.encode_pass(&mut encoder, with.map(|slot| (slot, set)), place, clear);
            set += 1;
        }
        if let Some(slot) = &slot {
            self.encode_results(&mut encoder, slot);
        }
        let depth = reads_back.then(|| {
            let copy = self.reader.copy(&self.stage.gpu, &mut encoder, &self.images);
            (copy, std::mem::take(&mut self.asks))
        });
        let submission = self.stage.gpu.queue.submit([encoder.finish()]);
        self.submissions += 1;
        if let Some(filling) = &mut self.filling {
            filling.clear();
        }
        let queries = std::mem::take(&mut self.open);
        if let Some((copy, _)) = &depth {
            copy.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        }
        if let Some(slot) = &slot {
            let bytes = queries.len() as u64 * RESULT_BYTES;
            slot.staging.slice(..bytes).map_async(wgpu::MapMode::Read, |_| {});
        }
        self.events.clear();
        self.proxy_vertices.clear();
        self.asks.clear();
        let unasked = std::mem::take(&mut self.unasked);
        let early = Vec::new();
        self.flights.push_back(Flight { slot, depth, early, submission, queries, unasked, more });
        self.stage.gpu.healthy()
    }

    /// Waits for a flight and appends its answers.
    fn land(&mut self, flight: Flight, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.stage.gpu.wait(Some(flight.submission))?;
        answers.extend(flight.early);
        if let Some(depth) = flight.depth {
            return self.answer_from_depth(depth, &flight.queries, &flight.unasked, answers);
        }
        let Some(slot) = flight.slot else { return Ok(()) };
        {
            let bytes = flight.queries.len() as u64 * RESULT_BYTES;
            let mapped = slot
                .staging
                .slice(..bytes)
                .get_mapped_range()
                .map_err(|error| OracleError::Lost(error.to_string()))?;
            let first = answers.len();
            // A query object leaves eight bytes, the pyramid four.
            let wide = if self.pyramid.is_some() { 4 } else { RESULT_BYTES as usize };
            let counts = mapped.chunks_exact(wide);
            answers.extend(flight.queries.iter().zip(counts).map(|(&query, count)| Answer {
                query,
                visible: count.iter().any(|&byte| byte != 0),
            }));
            for place in flight.unasked {
                answers[first + place as usize].visible = true;
            }
        }
        slot.staging.unmap();
        self.free.push(slot);
        Ok(())
    }

    /// The next question's number.
    fn number(&mut self) -> QueryId {
        let query = QueryId(self.asked);
        self.asked += 1;
        self.open.push(query);
        query
    }

    fn ask_rectangles(&mut self, proxies: &[Proxy]) -> QueryId {
        let (first, question) = (self.asks.len() as u32, self.open.len() as u32);
        for proxy in proxies {
            match *proxy {
                Proxy::Rectangle { min, max, depth } | Proxy::Hull { min, max, depth, .. } => {
                    self.asks.push(Ask { low: min, high: max, depth, question });
                }
                Proxy::Box { .. } => self.unasked.push(question),
            }
        }
        if self.pyramid.is_some() {
            let end = self.asks.len() as u32;
            self.events.push(Event::AskPyramid { first, end });
        }
        self.number()
    }

    /// Encodes the questions from `from` on up to the next draw; returns where it stopped.
    fn encode_pyramid(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        slot: &Slot,
        pyramid: &Pyramid,
        from: usize,
    ) -> usize {
        let asks = self.events[from..].iter().map_while(|event| match *event {
            Event::AskPyramid { first, end } => Some(first..end),
            _ => None,
        });
        let (mut count, mut run) = (0, 0..0);
        for ask in asks {
            // The asks of following events follow one another.
            let start = if count == 0 { ask.start } else { run.start };
            run = start..ask.end;
            count += 1;
        }
        if !run.is_empty() {
            let buffers = (&slot.proxies, &slot.resolved);
            let depth = &self.images.depth_view;
            let (gpu, pipelines) = (&self.stage.gpu, &self.stage.drawing.pyramid);
            pyramid.encode(gpu, pipelines, encoder, depth, buffers, run);
        }
        from + count
    }

    /// Sends the results of the batch on their way back.
    fn encode_results(&self, encoder: &mut wgpu::CommandEncoder, slot: &Slot) {
        let (resolved, staging) = (&slot.resolved, &slot.staging);
        if self.pyramid.is_some() {
            let bytes = self.open.len() as u64 * RESULT_BYTES;
            return encoder.copy_buffer_to_buffer(resolved, 0, staging, 0, bytes);
        }
        let per_pass = self.queries_per_pass;
        for set in 0..self.open.len().div_ceil(per_pass) {
            let count = (self.open.len() - set * per_pass).min(per_pass);
            let from = set as u64 * set_bytes(per_pass);
            encoder.resolve_query_set(&slot.queries[set], 0..count as u32, resolved, from);
            // Aligned there, one after another here.
            let (to, bytes) = ((set * per_pass) as u64 * RESULT_BYTES, count as u64 * RESULT_BYTES);
            encoder.copy_buffer_to_buffer(resolved, from, staging, to, bytes);
        }
    }

    /// A slot with room for this batch, made or reused.
    fn slot(&mut self) -> Slot {
        let vertices = size_of_val(self.proxy_vertices.as_slice()) as u64;
        let proxies = vertices.max(size_of_val(self.asks.as_slice()) as u64);
        let with_objects = self.questions == Questions::Queries;
        let per_pass = self.queries_per_pass;
        let need = Need { questions: self.open.len(), proxies, with_objects, per_pass };
        Slot::with_room(&self.stage.gpu.device, self.free.pop(), need)
    }

    /// Encodes the batch's events from `from` on as one pass of no more questions than a pass may have; returns where it stopped.
    fn encode_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        slot: Option<(&Slot, usize)>,
        from: usize,
        clear: bool,
    ) -> usize {
        let load =
            if clear { wgpu::LoadOp::Clear(self.stage.clear_depth()) } else { wgpu::LoadOp::Load };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(self.images.depth_attachment(load)),
            occlusion_query_set: slot.map(|(slot, set)| &slot.queries[set]),
            ..Default::default()
        });
        let mut queries = 0;
        let mut drawing: Option<ObjectId> = None;
        for (place, event) in self.events.iter().enumerate().skip(from) {
            match *event {
                Event::Draw(part) => {
                    let partition = &self.stage.stage.partition;
                    let (object, local) = partition.locate(part);
                    if drawing != Some(object) {
                        let mesh = self.parts(partition.mesh_index(object));
                        pass.set_pipeline(&self.stage.drawing.draw);
                        pass.set_immediates(0, bytemuck::bytes_of(&self.drawn_object(object)));
                        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                        pass.set_index_buffer(mesh.by_part.slice(..), wgpu::IndexFormat::Uint32);
                        drawing = Some(object);
                    }
                    let this = &partition.mesh(object).parts[local as usize];
                    let first = this.first_triangle * 3;
                    let indices = first..first + this.triangle_count * 3;
                    pass.draw_indexed(indices, this.first_vertex as i32, 0..1);
                }
                Event::AskPyramid { .. } => return place,
                Event::Ask { first_vertex, end_vertex } => {
                    let Some((slot, _)) = slot else { continue };
                    if queries == self.queries_per_pass {
                        return place;
                    }
                    drawing = None;
                    pass.set_pipeline(&self.stage.drawing.ask);
                    pass.set_vertex_buffer(0, slot.proxies.slice(..));
                    pass.begin_occlusion_query(queries as u32);
                    pass.draw(first_vertex..end_vertex, 0..1);
                    pass.end_occlusion_query();
                    queries += 1;
                }
            }
        }
        self.events.len()
    }
}

impl Oracle for Hardware {
    fn name(&self) -> &'static str {
        self.questions.name()
    }

    fn tolerance(&self) -> Tolerance {
        self.stage.gpu.tolerance()
    }

    fn device(&self) -> Option<String> {
        Some(self.stage.gpu.name().to_owned())
    }

    fn memory(&self) -> Option<Memory> {
        self.limited.as_ref().map(|limited| limited.residency.counts())
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        while let Some(flight) = self.flights.pop_front() {
            self.land(flight, &mut Vec::new())?;
        }
        // What was drawn and never submitted is forgotten.
        self.all_done();
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        if let Some(limited) = &mut self.limited {
            let mut steps = Vec::new();
            limited.residency.begin_frame(view, &mut steps);
            self.carry_out(&steps)?;
        }
        self.matrices.clear();
        self.matrices.extend_from_slice(view.clip_from_object);
        self.cleared = false;
        self.asked = 0;
        if let Some(filling) = &mut self.filling {
            filling.clear();
        }
        self.events.clear();
        self.open.clear();
        self.proxy_vertices.clear();
        self.asks.clear();
        self.unasked.clear();
        self.stage.gpu.healthy()
    }

    fn draw_part(&mut self, part: PartId) {
        if self.failed.is_some() {
            return;
        }
        if let Err(error) = self.before_draw(part) {
            // Nothing is encoded for a mesh that could not be loaded.
            self.failed.get_or_insert(error);
            return;
        }
        self.events.push(Event::Draw(part));
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        if self.questions != Questions::Queries {
            return self.ask_rectangles(proxies);
        }
        if self.failed.is_none()
            && let Err(error) =
                self.make_room(Binned::Question, |this| this.question_bytes(proxies))
        {
            self.failed = Some(error);
        }
        let (first_vertex, order) = (self.proxy_vertices.len(), self.stage.stage.depth);
        let viewport = self.stage.stage.viewport;
        for proxy in proxies {
            match *proxy {
                Proxy::Rectangle { min, max, depth } => {
                    self.proxy_vertices.extend(rectangle_triangles(viewport, min, max, depth));
                }
                Proxy::Hull { hull, depth, .. } => {
                    self.proxy_vertices.extend(hull_proxy_triangles(viewport, &hull, depth));
                }
                Proxy::Box { clip_from_box, min, max } => {
                    self.proxy_vertices.extend(box_proxy_triangles(&clip_from_box, min, max));
                }
            }
        }
        let new = &mut self.proxy_vertices[first_vertex..];
        new.iter_mut().for_each(|vertex| vertex[2] = order.on_device(vertex[2]));
        let (first_vertex, end_vertex) = (first_vertex as u32, self.proxy_vertices.len() as u32);
        self.events.push(Event::Ask { first_vertex, end_vertex });
        self.number()
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        match self.failed.take() {
            Some(error) => Err(error),
            None => self.flush(false),
        }
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        // What was sent ahead of the batch's end is handed over with the end.
        let Some(last) = self.flights.iter().position(|flight| !flight.more) else {
            return Ok(());
        };
        for flight in self.flights.drain(..=last).collect::<Vec<_>>() {
            self.land(flight, answers)?;
        }
        if self.flights.is_empty() && self.events.is_empty() {
            self.all_done();
        }
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        self.submit()?;
        self.collect(&mut Vec::new())?;
        self.images.read_back(&self.stage.gpu, self.encoder()).map(Some)
    }

    fn redraw(&mut self, parts: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        let images = self.redraw_images.take().unwrap_or_else(|| Images::new(&self.stage, true));
        let mut encoder = self.encoder();
        let drawn_object = |object| self.drawn_object(object);
        encode_redraw(&self.stage, &drawn_object, &mut encoder, &images, parts);
        let read_back = images.read_back(&self.stage.gpu, encoder);
        self.redraw_images = Some(images);
        read_back.map(Some)
    }
}
