//! Meshes for tests. In: extents, mm. Out: STL text.

/// A box as an STL file.
pub fn box_as_stl([x, y, z]: [[f64; 2]; 3]) -> String {
    let corner = |k: usize| format!("vertex {} {} {}\n", x[k & 1], y[k >> 1 & 1], z[k >> 2]);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    let facet =
        |t: [usize; 3]| format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", t.map(corner).concat());
    format!("solid box\n{}endsolid box\n", triangles.map(facet).collect::<String>())
}
