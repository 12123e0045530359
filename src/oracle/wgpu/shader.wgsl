// The raster rules' vertex transform in its written order, and proxies that come in clip space.

@group(0) @binding(0) var<storage, read> clip_from_object: array<mat4x4<f32>>;
@group(0) @binding(1) var<storage, read> first_part: array<u32>;

struct Varying {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) part: u32,
}

@vertex
fn part_vertex(
    @location(0) p: vec3<f32>,
    @location(1) local_part: u32,
    @builtin(instance_index) object: u32,
) -> Varying {
    let m = clip_from_object[object];
    let position = ((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3];
    return Varying(position, first_part[object] + local_part + 1u);
}

@fragment
fn part_fragment(in: Varying) -> @location(0) u32 {
    return in.part;
}

@vertex
fn proxy_vertex(@location(0) clip: vec4<f32>) -> @builtin(position) vec4<f32> {
    return clip;
}
