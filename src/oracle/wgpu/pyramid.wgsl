// Rectangles asked about against maxima of depth: each question is answered exactly as an occlusion
// query with LessEqual would, "is any stored depth in the rectangle at or beyond the proxy's?", but
// most of a rectangle is settled by tiles of 8 x 8 and blocks of 64 x 64 samples.

struct Ask {
    // Half-open, in samples.
    low: vec2<u32>,
    high: vec2<u32>,
    depth: f32,
    question: u32,
}

// Whether the target holds reversed depth: what is stored, its sign turned, is what questions compare.
override reversed: bool = false;

@group(0) @binding(0) var depth: texture_depth_2d;
@group(0) @binding(1) var<storage, read_write> tiles: array<f32>;
@group(0) @binding(2) var<storage, read_write> blocks: array<f32>;
@group(0) @binding(3) var<storage, read> asks: array<Ask>;
@group(0) @binding(4) var<storage, read_write> answers: array<atomic<u32>>;
// First ask and one beyond the last of the dispatch.
@group(0) @binding(5) var<storage, read> run: array<vec2<u32>>;

fn stored(place: vec2<u32>) -> f32 {
    let depth = textureLoad(depth, place, 0);
    return select(depth, -depth, reversed);
}

fn tile_count() -> vec2<u32> {
    return (textureDimensions(depth) + 7u) / 8u;
}

fn block_count() -> vec2<u32> {
    return (textureDimensions(depth) + 63u) / 64u;
}

@compute @workgroup_size(8, 8)
fn reduce_tiles(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = tile_count();
    if id.x >= count.x || id.y >= count.y {
        return;
    }
    let end = min(id.xy * 8u + 8u, textureDimensions(depth));
    // Nearer than everything, either way.
    var most = -1.0;
    for (var y = id.y * 8u; y < end.y; y++) {
        for (var x = id.x * 8u; x < end.x; x++) {
            most = max(most, stored(vec2<u32>(x, y)));
        }
    }
    tiles[id.y * count.x + id.x] = most;
}

@compute @workgroup_size(8, 8)
fn reduce_blocks(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = block_count();
    if id.x >= count.x || id.y >= count.y {
        return;
    }
    let tiled = tile_count();
    let end = min(id.xy * 8u + 8u, tiled);
    // Nearer than everything, either way.
    var most = -1.0;
    for (var y = id.y * 8u; y < end.y; y++) {
        for (var x = id.x * 8u; x < end.x; x++) {
            most = max(most, tiles[y * tiled.x + x]);
        }
    }
    blocks[id.y * count.x + id.x] = most;
}

fn holds(ask: Ask, low: vec2<u32>, side: u32) -> bool {
    return all(ask.low <= low) && all(low + side <= ask.high);
}

fn any_sample(ask: Ask, tile: vec2<u32>) -> bool {
    let low = max(ask.low, tile * 8u);
    let high = min(ask.high, tile * 8u + 8u);
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            if stored(vec2<u32>(x, y)) >= ask.depth {
                return true;
            }
        }
    }
    return false;
}

fn any_tile(ask: Ask, block: vec2<u32>) -> bool {
    let count = tile_count();
    let low = max(ask.low / 8u, block * 8u);
    let high = min((ask.high + 7u) / 8u, block * 8u + 8u);
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            if tiles[y * count.x + x] >= ask.depth {
                let tile = vec2<u32>(x, y);
                if holds(ask, tile * 8u, 8u) || any_sample(ask, tile) {
                    return true;
                }
            }
        }
    }
    return false;
}

@compute @workgroup_size(64)
fn answer(@builtin(global_invocation_id) id: vec3<u32>) {
    let number = run[0].x + id.x;
    if number >= run[0].y {
        return;
    }
    let ask = asks[number];
    let count = block_count();
    let low = ask.low / 64u;
    let high = (ask.high + 63u) / 64u;
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            if blocks[y * count.x + x] >= ask.depth {
                let block = vec2<u32>(x, y);
                if holds(ask, block * 64u, 64u) || any_tile(ask, block) {
                    atomicStore(&answers[ask.question], 1u);
                    return;
                }
            }
        }
    }
}
