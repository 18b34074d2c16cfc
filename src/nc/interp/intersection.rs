//! Where two elements of a contour meet in the plane. In: lines and circles. Out: the meeting nearest to a corner.

pub(crate) type Point = [f64; 2];

/// An element of the contour after it was moved aside.
#[derive(Debug, Clone, Copy)]
pub(crate) enum OffsetElement {
    /// Through a point, along a unit direction.
    Line(Point, Point),
    /// Centre and radius.
    Circle(Point, f64),
}

/// Where two moved elements meet, nearest to the corner of the contour.
pub(crate) fn meet(before: OffsetElement, after: OffsetElement, near: Point, corner: Point) -> Option<Point> {
    let candidates = match (before, after) {
        (OffsetElement::Line(p, u), OffsetElement::Line(q, v)) => {
            let sine = cross(u, v);
            let t = cross([q[0] - p[0], q[1] - p[1]], v) / sine;
            if sine == 0.0 { Vec::new() } else { vec![[p[0] + t * u[0], p[1] + t * u[1]]] }
        }
        (OffsetElement::Line(p, u), OffsetElement::Circle(c, r))
        | (OffsetElement::Circle(c, r), OffsetElement::Line(p, u)) => line_circle(p, u, c, r),
        (OffsetElement::Circle(c, r), OffsetElement::Circle(d, s)) => circles(c, r, d, s),
    };
    let far = |p: &Point| distance(*p, near) + distance(*p, corner);
    candidates.into_iter().min_by(|p, q| far(p).total_cmp(&far(q)))
}

fn line_circle(p: Point, u: Point, c: Point, r: f64) -> Vec<Point> {
    let w = [c[0] - p[0], c[1] - p[1]];
    let (along, height) = (dot(w, u), cross(u, w));
    let square = r * r - height * height;
    if square < 0.0 {
        return Vec::new();
    }
    [-1.0, 1.0].map(|sign| along + sign * square.sqrt()).map(|t| [p[0] + t * u[0], p[1] + t * u[1]]).to_vec()
}

fn circles(c: Point, r: f64, d: Point, s: f64) -> Vec<Point> {
    let apart = distance(c, d);
    if apart < 1e-12 {
        return Vec::new();
    }
    let along = (apart * apart + r * r - s * s) / (2.0 * apart);
    let square = r * r - along * along;
    if square < 0.0 {
        return Vec::new();
    }
    let u = unit([d[0] - c[0], d[1] - c[1]]);
    let foot = [c[0] + along * u[0], c[1] + along * u[1]];
    [-1.0, 1.0].map(|sign| sign * square.sqrt()).map(|h| [foot[0] - h * u[1], foot[1] + h * u[0]]).to_vec()
}

pub(crate) fn cross(u: Point, v: Point) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}

pub(crate) fn dot(u: Point, v: Point) -> f64 {
    u[0] * v[0] + u[1] * v[1]
}

pub(crate) fn distance(p: Point, q: Point) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

pub(crate) fn unit(v: Point) -> Point {
    let length = v[0].hypot(v[1]).max(f64::MIN_POSITIVE);
    [v[0] / length, v[1] / length]
}
