//! What a batch of questions needs on the device: query objects and the buffers of its proxies and
//! results. It must not know what is asked.

/// Bytes of one result.
pub(super) const RESULT_BYTES: u64 = 8;

/// Bytes from the results of one query set to those of the next, where a device may write them.
pub(super) fn set_bytes(per_pass: usize) -> u64 {
    (per_pass as u64 * RESULT_BYTES).next_multiple_of(wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT)
}

/// How much of it.
pub(super) struct Need {
    pub(super) questions: usize,
    /// Bytes of proxies.
    pub(super) proxies: u64,
    /// Whether query objects answer.
    pub(super) with_objects: bool,
    /// Query objects of one set, which a pass takes.
    pub(super) per_pass: usize,
}

/// What a batch needs on the device, kept for the next one.
pub(super) struct Slot {
    pub(super) queries: Vec<wgpu::QuerySet>,
    pub(super) resolved: wgpu::Buffer,
    pub(super) staging: wgpu::Buffer,
    pub(super) proxies: wgpu::Buffer,
}

impl Slot {
    /// Room for `bytes` of results and for proxies of `vertices` bytes.
    fn new(device: &wgpu::Device, bytes: u64, vertices: u64) -> Self {
        let buffer = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: size.next_power_of_two(),
                usage,
                mapped_at_creation: false,
            })
        };
        let written = wgpu::BufferUsages::QUERY_RESOLVE
            | wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC;
        let read = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let proxies =
            wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        Self {
            queries: Vec::new(),
            resolved: buffer(bytes, written),
            staging: buffer(bytes, read),
            proxies: buffer(vertices, proxies),
        }
    }

    /// `slot`, or a new one, with room for what a batch needs.
    pub(super) fn with_room(device: &wgpu::Device, slot: Option<Self>, need: Need) -> Self {
        let sets = need.questions.div_ceil(need.per_pass);
        let bytes = sets as u64 * set_bytes(need.per_pass);
        let mut slot = slot.unwrap_or_else(|| Self::new(device, bytes, need.proxies));
        if slot.resolved.size() < bytes || slot.proxies.size() < need.proxies {
            let (bytes, proxies) =
                (bytes.max(slot.resolved.size()), need.proxies.max(slot.proxies.size()));
            slot = Self { queries: slot.queries, ..Self::new(device, bytes, proxies) };
        }
        while need.with_objects && slot.queries.len() < sets {
            slot.queries.push(device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Occlusion,
                count: need.per_pass as u32,
            }));
        }
        slot
    }
}
