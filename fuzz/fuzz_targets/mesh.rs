//! Any bytes as an STL file, as a body and as a surface: what comes back is finite, and a body is as its triangles say.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use feedwright::stock::mesh::{Mesh, read_stl, read_surface};

fn go_through(data: &[u8]) {
    for mesh in [read_stl(data), read_surface(data)].into_iter().flatten() {
        check(&mesh.0);
    }
}

fn check(mesh: &Mesh) {
    assert!(!mesh.triangles.is_empty(), "no body without triangles");
    assert!(mesh.vertices.iter().all(|vertex| vertex.iter().all(|x| x.is_finite())), "vertices are numbers");
    let known = |corner: &u32| (*corner as usize) < mesh.vertices.len();
    assert!(mesh.triangles.iter().flatten().all(known), "triangles name vertices");
}

target::target!(go_through);
