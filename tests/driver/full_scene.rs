//! Shows, without plainsight, whether a Vulkan driver miscounts occlusion queries that begin or end where the
//! memory for one batch of binned commands runs out. Mesa 22.3.6's llvmpipe does; run it to try a newer one:
//!
//!     cargo run --release --locked --example full_scene [-- ADAPTER [FIRST STEP TRIALS]]
//!
//! Each trial draws a picture-wide rectangle, `FIRST + STEP · trial` tiny triangles and then questions: of
//! every two, one about a rectangle before the first (all samples pass), one about a rectangle behind it (none
//! does). The more triangles, the earlier among the questions the memory runs out. Then passes of many
//! questions and no triangles, and each wrong trial again while the device is busy with others. Prints a line for each trial that
//! goes wrong and a verdict; exit code 0 where every empty question came back empty, 1 where one did not, 3
//! without such a device. Half a minute on two cores. Not run in CI.

// A program of its own that prints.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

use wgpu::util::DeviceExt;

/// Pixels; 20 × 16 tiles of 64 × 64.
const WIDTH: u32 = 1280;
const HEIGHT: u32 = 1024;
/// Questions of a trial.
const QUESTIONS: u32 = 128;
/// Most questions of a pass.
const MOST_QUESTIONS: u32 = 1536;
/// Trials by default: 36 MiB hold 230,000 such triangles, and a question takes as much as 490.
const FIRST: u32 = 150_000;
const STEP: u32 = 1_001;
const TRIALS: u32 = 90;
/// Submissions that keep the device busy, and rectangles of each.
const BUSY: u32 = 4;
const WALLS: u32 = 200;
/// Vertices of a rectangle.
const CORNERS: u32 = 6;

const SHADER: &str =
    "@vertex fn vertex(@location(0) at: vec4f) -> @builtin(position) vec4f { return at; }";

/// Two triangles over the whole picture.
fn rectangle(depth: f32) -> [[f32; 4]; CORNERS as usize] {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let [a, b, c, d] = corners.map(|[x, y]| [x, y, depth, 1.0]);
    [a, b, c, a, c, d]
}

/// The first rectangle, one before it, one behind it, and `triangles` of a few pixels each behind it.
fn vertices(triangles: u32) -> Vec<[f32; 4]> {
    let mut all = [rectangle(0.5), rectangle(0.25), rectangle(0.75)].concat();
    for number in 0..triangles {
        let x = (number % 320) as f32 / 160.0 - 0.999;
        let y = (number / 320 % 256) as f32 / 128.0 - 0.999;
        all.extend([[x, y], [x + 0.005, y], [x, y + 0.005]].map(|[x, y]| [x, y, 0.9, 1.0]));
    }
    all
}

struct Bench {
    device: wgpu::Device,
    queue: wgpu::Queue,
    draw: wgpu::RenderPipeline,
    ask: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    depth: wgpu::TextureView,
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
}

fn pipeline(
    device: &wgpu::Device,
    compare: wgpu::CompareFunction,
    write: bool,
) -> wgpu::RenderPipeline {
    let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x4];
    let buffers = [Some(wgpu::VertexBufferLayout {
        array_stride: 16,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    })];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &shader,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

impl Bench {
    fn new(device: wgpu::Device, queue: wgpu::Queue, triangles: u32) -> Self {
        let depth = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: WIDTH, height: HEIGHT, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let counts = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: u64::from(MOST_QUESTIONS) * 8,
                usage,
                mapped_at_creation: false,
            })
        };
        Self {
            draw: pipeline(&device, wgpu::CompareFunction::Less, true),
            ask: pipeline(&device, wgpu::CompareFunction::LessEqual, false),
            vertices: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents: bytemuck::cast_slice(&vertices(triangles)),
                usage: wgpu::BufferUsages::VERTEX,
            }),
            depth: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Occlusion,
                count: MOST_QUESTIONS,
            }),
            resolved: counts(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            staging: counts(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            device,
            queue,
        }
    }

    /// Sends one pass of `triangles`, `walls`, rectangles behind the first that only take time, and `questions`.
    fn send(&self, triangles: u32, walls: u32, questions: u32) -> wgpu::SubmissionIndex {
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            occlusion_query_set: Some(&self.queries),
            ..Default::default()
        });
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_pipeline(&self.draw);
        pass.draw(0..CORNERS, 0..1);
        pass.draw(3 * CORNERS..3 * CORNERS + triangles * 3, 0..1);
        (0..walls).for_each(|_| pass.draw(2 * CORNERS..3 * CORNERS, 0..1));
        pass.set_pipeline(&self.ask);
        for question in 0..questions {
            let first = if question % 2 == 0 { CORNERS } else { 2 * CORNERS };
            pass.begin_occlusion_query(question);
            pass.draw(first..first + CORNERS, 0..1);
            pass.end_occlusion_query();
        }
        drop(pass);
        if questions > 0 {
            let bytes = u64::from(questions) * 8;
            encoder.resolve_query_set(&self.queries, 0..questions, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, bytes);
        }
        self.queue.submit([encoder.finish()])
    }

    /// Samples that passed, by question.
    fn counts(&self, triangles: u32, questions: u32) -> Vec<u64> {
        let sent = self.send(triangles, 0, questions);
        let slice = self.staging.slice(..u64::from(questions) * 8);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        let wait = wgpu::PollType::Wait { submission_index: Some(sent), timeout: None };
        self.device.poll(wait).expect("the device is not lost");
        let counts = {
            let mapped = slice.get_mapped_range().expect("the buffer was mapped");
            bytemuck::pod_collect_to_vec(&mapped)
        };
        self.staging.unmap();
        counts
    }
}

/// Prints and returns the questions whose count is not what was drawn, each with its count.
fn wrong(what: &str, counts: &[u64]) -> Vec<(usize, u64)> {
    let whole = u64::from(WIDTH) * u64::from(HEIGHT);
    let right = |question: usize| if question.is_multiple_of(2) { whole } else { 0 };
    let all = counts.iter().copied().enumerate();
    let wrong: Vec<_> = all.filter(|&(question, count)| count != right(question)).collect();
    for (question, count) in &wrong {
        println!("{what}: question {question} counts {count}, not {}", right(*question));
    }
    wrong
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments.first().map_or("llvmpipe", String::as_str).to_lowercase();
    let number = |place: usize, default| {
        arguments.get(place).map_or(default, |text: &String| text.parse().expect("a number"))
    };
    let (first, step, trials) = (number(1, FIRST), number(2, STEP), number(3, TRIALS));
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let named = |adapter: &&wgpu::Adapter| adapter.get_info().name.to_lowercase().contains(&name);
    let Some(adapter) = adapters.iter().find(named) else {
        eprintln!("no Vulkan adapter is called '{name}'");
        return ExitCode::from(3);
    };
    println!("{} ({})", adapter.get_info().name, adapter.get_info().driver_info);
    let opened = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: adapter.limits(),
        ..Default::default()
    }));
    let (device, queue) = opened.expect("the device opens");
    let bench = Bench::new(device, queue, first + step * trials);

    let mut slid = Vec::new();
    for triangles in (0..trials).map(|trial| first + step * trial) {
        let counts = bench.counts(triangles, QUESTIONS);
        if !wrong(&format!("{triangles} triangles"), &counts).is_empty() {
            slid.push(triangles);
        }
    }
    println!("{} of {trials} trials with triangles are wrong", slid.len());

    let passes = [128, 256, 512, 640, 768, 1024, MOST_QUESTIONS];
    let long = passes.iter().filter(|&&questions| {
        !wrong(&format!("a pass of {questions} questions"), &bench.counts(0, questions)).is_empty()
    });
    let long = long.count();
    println!("{long} of {} passes of questions alone are wrong", passes.len());

    // What is still being drawn decides which of its structures the driver uses again.
    let mut repeated = 0;
    for &triangles in &slid {
        let alone = bench.counts(triangles, QUESTIONS);
        for _ in 0..BUSY {
            bench.send(0, WALLS, 0);
        }
        repeated += usize::from(bench.counts(triangles, QUESTIONS) == alone);
    }
    println!("{repeated} of {} wrong trials repeat on a busy device", slid.len());

    if slid.is_empty() && long == 0 {
        println!("verdict: every question is right; this driver has not shown the fault");
        ExitCode::SUCCESS
    } else {
        println!(
            "verdict: WRONG COUNTS; questions must not begin or end in a full scene of this driver"
        );
        ExitCode::FAILURE
    }
}
