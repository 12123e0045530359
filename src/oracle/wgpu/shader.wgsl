// The raster rules' vertex transform in its written order, and proxies that come in clip space.

struct Object {
    clip_from_object: mat4x4<f32>,
    first_part: u32,
}

// Immediate, not in a buffer: per vertex lavapipe would check and gather each element of it.
var<immediate> object: Object;

struct Varying {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) part: u32,
}

fn transformed(p: vec3<f32>) -> vec4<f32> {
    let m = object.clip_from_object;
    return ((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3];
}

// Where depth alone is drawn.
@vertex
fn depth_vertex(@location(0) p: vec3<f32>) -> @invariant @builtin(position) vec4<f32> {
    return transformed(p);
}

@vertex
fn part_vertex(@location(0) p: vec3<f32>, @location(1) local_part: u32) -> Varying {
    return Varying(transformed(p), object.first_part + local_part + 1u);
}

@fragment
fn part_fragment(in: Varying) -> @location(0) u32 {
    return in.part;
}

@vertex
fn proxy_vertex(@location(0) clip: vec4<f32>) -> @builtin(position) vec4<f32> {
    return clip;
}
