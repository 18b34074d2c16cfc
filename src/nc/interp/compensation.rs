//! Cutter radius compensation (G40, G41, G42, G41.1, G42.1). In: elements of the programmed contour. Out: moves of the tool beside it.
//!
//! In the plane of the work, with side s = +1 left of the contour (G41) and −1 right of it, the tool runs on the contour
//! moved by s·r along its left normal. At a corner where the contour turns away from the tool by more than 0.05 rad an
//! arc about the corner is put in (straight at rapid); where it turns towards the tool by more than that, the element
//! before is cut back to the intersection of the two moved elements. Entry ends square to its own end. This is how
//! LinuxCNC 2.9 does it; on Fanuc, Haas, Siemens and Heidenhain entry ends square to the element after it, and other
//! controls may go around an outer corner straight, where nothing is cut. What cannot be reached without gouging is refused.

use super::arc::sweep;
use super::interpreter::{Family, Interpreter};
use super::intersection::{OffsetElement, Point, cross, distance, dot, meet, unit};
use super::offsets::AGREES_MM;
use super::state::{Active, Contour, Length, Motion, PreviousElement};
use super::words::Words;
use crate::diag::{Severity, Span};
use crate::machine::Compensation;
use crate::nc::doubt::Doubt;
use crate::nc::toolpath::{Freeze, MoveKind};
use crate::path::{Arc, Curve, Vec3};

/// Change of direction below which two elements are simply joined, rad.
const JOINED_RAD: f64 = 0.05;
/// Slack in lengths and angles, mm and rad.
const SLACK: f64 = 1e-6;

impl Active {
    /// Where the tool is when it is at a point of the contour that runs along `direction`.
    pub(crate) fn beside(self, p: Point, direction: Point) -> Point {
        offset(p, direction, self)
    }
}

/// An element of the contour that is to be followed, in coordinates of the work offset.
#[derive(Debug, Clone, Copy)]
struct Element {
    from: Vec3,
    to: Vec3,
    /// Centre and angle turned of an arc.
    arc: Option<(Vec3, f64)>,
}

/// Why a control would stop.
type Refusal = &'static str;

const GOUGE: Refusal = "the contour cannot be followed with this tool radius without gouging";

impl<F: Family> Interpreter<'_, F> {
    /// D without G41 or G42 on a control of Macro B, where it is modal: under compensation the radius changes, else it waits for the next G41.
    pub(crate) fn d_alone(&mut self, words: &Words) {
        let own = |code: u16| (400..=429).contains(&code) || [100, 120, 130, 650, 660, 1500].contains(&code);
        let switches = words.g.iter().any(|(code, _)| own(*code));
        let Some(place) = words.span(b'D').filter(|_| self.dialect().macro_b && !F::EDGES_BY_D && !switches) else {
            return;
        };
        if self.compensation.on {
            self.doubt(Doubt::Compensation, place);
        }
        self.compensation.d_alone = true;
    }

    /// G41, G42 and their variants with the diameter in D (`inline`), or G40 with `side` 0.
    pub(crate) fn switch_compensation(&mut self, side: f64, inline: bool, words: &Words, place: Span) {
        // Where only the control knows how far aside the tool is, it knows the way back as well.
        self.compensation.comes_back |= self.compensation.contour == Contour::Unknown;
        self.compensation.active = None;
        self.compensation.contour = Contour::Off;
        self.compensation.on = side != 0.0;
        if side == 0.0 {
            return;
        }
        if words.has(b'D') {
            self.compensation.d_alone = false;
        } else if self.compensation.d_alone {
            self.doubt(Doubt::Compensation, place);
        }
        let range = self.compensation.ranges;
        self.compensation.ranges += 1;
        let diameter = self.compensation_diameter(inline, words);
        let refused = self.compensation.refused_before.contains(&range);
        let meaning = match self.env.compensation {
            Some(meaning) => Some(meaning),
            None if inline || self.stated_diameter(inline, words).is_some() || self.dialect().always_offsets => {
                Some(Compensation::Control)
            }
            None if refused => Some(Compensation::Wear),
            None => None,
        };
        match (meaning, diameter) {
            (Some(meaning @ (Compensation::Wear | Compensation::InverseWear)), _) => {
                let sign = if meaning == Compensation::Wear { 1.0 } else { -1.0 };
                match self.wear_mm(inline, words, place) {
                    0.0 => self.compensation.contour = Contour::AsWritten,
                    wear => {
                        let side = side * sign * wear.signum();
                        self.compensation.active = Some(Active { side, radius: wear.abs(), range, before: None });
                    }
                }
            }
            (Some(Compensation::Control), Some(diameter)) => {
                let side = side * diameter.signum();
                if diameter != 0.0 {
                    self.compensation.active = Some(Active { side, radius: 0.5 * diameter.abs(), range, before: None });
                }
            }
            (None, Some(diameter)) if !self.compensation.deciding => {
                // A trial: if a control would have to refuse the offset contour, the path is not meant to be offset.
                self.compensation.undecided = true;
                self.compensation.active = Some(Active { side, radius: 0.5 * diameter, range, before: None });
            }
            _ => {
                self.compensation.contour = Contour::Unknown;
                let what = if diameter.is_none() { "the radius of the tool" } else { "what G41/G42 means here" };
                let text = format!("{what} is not known: nor is the path up to G40, whose feeds are kept");
                let help = "set compensation = \"control\" or \"wear\" under [machine], and give the tool";
                self.say("nc::compensation", Severity::Warning, place, text, help);
                self.doubt(Doubt::Compensation, place);
            }
        }
        if let Some(meaning) = meaning {
            self.doubt_of_radius(meaning, inline, words, place);
        }
    }

    /// Offsets with a number of their own hold a radius that only the control knows. It is taken as that of the tool, or as none where the path is
    /// that of the tool; where the program writes another, or a tool runs with two offsets, it is in doubt.
    fn doubt_of_radius(&mut self, meaning: Compensation, inline: bool, words: &Words, place: Span) {
        if inline || self.stated_diameter(inline, words).is_some() {
            return;
        }
        let tool = self.modal.tool;
        let in_force = match self.tool_length.now {
            Length::Number(edge) if F::EDGES_BY_D => edge,
            _ if F::EDGES_BY_D => 1,
            _ => tool,
        };
        let number = words.get(b'D').map_or(in_force, |d| d.max(0.0) as u32);
        let control = meaning == Compensation::Control;
        let expected = if control { self.env.diameter_mm(tool).map(|diameter| 0.5 * diameter) } else { Some(0.0) };
        let written = self.compensation.radius_written.iter().rfind(|(known, _)| *known == number);
        if let Some((_, radius)) = written {
            if expected.is_none_or(|expected| (radius - expected).abs() > AGREES_MM) {
                self.doubt(Doubt::Compensation, place);
            }
            return;
        }
        let is_new = !self.compensation.offsets_used.contains(&(tool, number));
        let has_other = self.compensation.offsets_used.iter().any(|(known, other)| *known == tool && *other != number);
        if is_new {
            self.compensation.offsets_used.push((tool, number));
        }
        // A number that is that of a tool names its radius where offsets are kept by tool; a Siemens has the first edge of each tool in D1.
        let names_its_tool = if F::EDGES_BY_D { number == 1 } else { self.env.diameter_mm(number).is_some() };
        let by_tool = self.dialect().d_names_tool && self.dialect().always_offsets;
        if !control || by_tool {
            return;
        }
        if has_other {
            self.doubt(Doubt::Compensation, place);
        } else if is_new && !names_its_tool {
            let text = format!("the radius in D{number} is not known here: that of the tool is taken");
            self.say("nc::radius", Severity::Note, place, text, "");
        }
    }

    /// Wear of the offset that the block names, mm on the radius: from the block itself, from the program (G10 L13), or from the setup, in
    /// this order; else 0, with a diagnostic.
    fn wear_mm(&mut self, inline: bool, words: &Words, place: Span) -> f64 {
        if let Some(diameter) = self.stated_diameter(inline, words) {
            return 0.5 * diameter * self.modal.unit_mm();
        }
        let number = words.get(b'D').map_or(self.modal.tool, |d| d.max(0.0) as u32);
        let known = |table: &[(u32, f64)]| table.iter().rfind(|(d, _)| *d == number).map(|(_, wear)| *wear);
        let wear = known(&self.compensation.wear_set).or_else(|| known(&self.env.wear_mm));
        if wear.is_none() && number != 0 {
            let text = format!("the wear value D{number} is not known here: it is taken as zero");
            let help = format!("write it under [machine]: wear_offsets = {{ D{number} = 0.0 }}");
            self.say("nc::wear", Severity::Note, place, text, &help);
        }
        wear.unwrap_or(0.0)
    }

    /// A diameter written in the block itself: D of G41.1, a D of G41 that is no whole number (a radius, as the tables of
    /// most controls hold radii), or R beside G41/G42 on a straight line.
    fn stated_diameter(&self, inline: bool, words: &Words) -> Option<f64> {
        let arc = matches!(self.modal.motion, Motion::Clockwise | Motion::CounterClockwise);
        let straight = !words.has_g(20) && !words.has_g(30) && (!arc || words.has_g(10) || words.has_g(0));
        let radius = words.get(b'R').filter(|radius| straight && *radius > 0.0);
        let twice = |radius: f64| if inline { radius } else { 2.0 * radius };
        words.get(b'D').filter(|d| inline || d.fract() != 0.0).map(twice).or(radius.map(|radius| 2.0 * radius))
    }

    /// Diameter that the D word, or the tool, stands for, mm.
    fn compensation_diameter(&self, inline: bool, words: &Words) -> Option<f64> {
        let value = words.get(b'D');
        if let Some(diameter) = self.stated_diameter(inline, words).filter(|_| !self.dialect().always_offsets) {
            return Some(diameter * self.modal.unit_mm());
        }
        if inline {
            return Some(value.unwrap_or(0.0) * self.modal.unit_mm());
        }
        let by_number = value.filter(|d| *d != 0.0 && d.fract() == 0.0 && self.dialect().d_names_tool);
        let number = by_number.map_or(self.modal.tool, |d| d as u32);
        let table = self.env.diameter_mm(number).or_else(|| self.env.diameter_mm(self.modal.tool));
        let oversize = 2.0 * self.compensation.oversize_mm;
        table.map(|diameter| diameter + oversize).or((self.modal.tool == 0 && value.is_none()).then_some(0.0))
    }

    /// Follows a line (or an arc about `arc`'s centre) of the contour; false when compensation is off.
    pub(crate) fn compensated(&mut self, kind: MoveKind, target: Vec3, arc: Option<(Vec3, f64)>) -> bool {
        self.block.splittable &= self.compensation.contour == Contour::Off && !self.compensation.comes_back;
        self.compensation.comes_back &= self.compensation.contour == Contour::Unknown;
        if self.compensation.contour == Contour::Unknown {
            self.block.freeze = self.block.freeze.or(Some(Freeze::Compensation));
        }
        let Some(mut active) = self.compensation.active else { return false };
        let (from, to) = (self.frame.apply(self.place.programmed), self.frame.apply(target));
        if self.frame.mirrors(self.modal.plane) {
            active.side = -active.side;
        }
        let element = Element { from, to, arc };
        let about = arc.map(|(centre, angle)| Curve::Arc(Arc::new(self.modal.plane, from, to, centre, angle)));
        self.block.contour_arc = match &about {
            Some(Curve::Arc(arc)) => Some((arc.centre, arc.radius_mm)),
            _ => None,
        };
        self.block.contour_mm = Some(about.unwrap_or(Curve::Line { from, to }).length());
        self.block.splittable = false;
        self.place.programmed = target;
        match self.follow(active, kind, element) {
            Ok(before) => {
                if let Some(active) = &mut self.compensation.active {
                    active.before = before;
                }
            }
            Err(why) => self.refuse(active.range, kind, element, why),
        }
        true
    }

    fn refuse(&mut self, range: usize, kind: MoveKind, element: Element, why: Refusal) {
        self.compensation.refused.push(range);
        let span = self.flow.source.program().span(self.block.id);
        if !self.compensation.undecided {
            let help = "correct the contour or the radius; set compensation = \"wear\" if the path is already offset";
            self.say("nc::compensation", Severity::Error, span, why, help);
            self.doubt(Doubt::Compensation, span);
        }
        self.block.freeze = self.block.freeze.or(Some(Freeze::Compensation));
        if let Some(active) = &mut self.compensation.active {
            active.before = None;
        }
        let curve = match element.arc {
            Some((centre, sweep)) if (self.place.tool - element.from).norm() < SLACK => {
                Curve::Arc(Arc::new(self.modal.plane, self.place.tool, element.to, centre, sweep))
            }
            _ => Curve::Line { from: self.place.tool, to: element.to },
        };
        self.tool_to(kind, curve);
    }

    fn follow(&mut self, active: Active, kind: MoveKind, element: Element) -> Result<Option<PreviousElement>, Refusal> {
        let (a, b, _) = self.modal.plane.axes();
        let flat = |p: Vec3| [p[a], p[b]];
        let (p, q) = (flat(element.from), flat(element.to));
        if element.arc.is_none() && distance(p, q) < 1e-9 {
            let to = self.lift(flat(self.place.tool), element.to);
            self.tool_to(kind, Curve::Line { from: self.place.tool, to });
            return Ok(active.before);
        }
        let Some(before) = active.before else { return self.enter_contour(active, kind, element).map(Some) };
        let (start, end) = directions(element, flat);
        let moved = moved_element(active, element, flat)?;
        if before.entry {
            self.cut_back(before, offset(p, start, active))?;
            return self.next_element(active, kind, element, moved, end).map(Some);
        }
        let turn = active.side * cross(before.direction, start).atan2(dot(before.direction, start));
        let reversal = turn.abs() > std::f64::consts::PI - JOINED_RAD;
        // Where the contour turns right back, its curvature says which way: towards the tool if it bends away from it.
        let bend = element.arc.map_or(0.0, |(_, angle)| angle.signum());
        let towards = if reversal { active.side * (before.bend + bend) < 0.0 } else { turn > JOINED_RAD };
        if towards {
            let corner = offset(p, start, active);
            let meeting = meet(before.moved, moved, corner, p).ok_or(GOUGE)?;
            self.cut_back(before, meeting)?;
        } else if turn < -JOINED_RAD || reversal {
            self.round_corner(active, kind, element.from, offset(p, start, active), -active.side * turn.abs());
        }
        self.next_element(active, kind, element, moved, end).map(Some)
    }

    /// Follows an element whose beginning the tool has reached.
    fn next_element(
        &mut self,
        active: Active,
        kind: MoveKind,
        element: Element,
        moved: OffsetElement,
        direction: Point,
    ) -> Result<PreviousElement, Refusal> {
        let index = self.out.moves.len();
        self.follow_moved(active, kind, element, moved)?;
        let bend = element.arc.map_or(0.0, |(_, angle)| angle.signum());
        Ok(PreviousElement { moved, direction, index, bend, entry: false })
    }

    /// Puts plane coordinates and the height of `at` together.
    fn lift(&self, plane: Point, at: Vec3) -> Vec3 {
        let (a, b, _) = self.modal.plane.axes();
        let mut point = at;
        (point[a], point[b]) = (plane[0], plane[1]);
        point
    }

    /// The first element: from where the tool is to square to the end.
    fn enter_contour(&mut self, active: Active, kind: MoveKind, element: Element) -> Result<PreviousElement, Refusal> {
        let (a, b, _) = self.modal.plane.axes();
        let flat = |p: Vec3| [p[a], p[b]];
        let (from, q) = (flat(self.place.tool), flat(element.to));
        if distance(from, q) <= active.radius {
            return Err("the entry move of radius compensation is not longer than the tool radius");
        }
        let index = self.out.moves.len();
        let Some((centre, angle)) = element.arc else {
            let direction = unit([q[0] - from[0], q[1] - from[1]]);
            let end = offset(q, direction, active);
            self.tool_to(kind, Curve::Line { from: self.place.tool, to: self.lift(end, element.to) });
            let square_to_next = self.dialect().entry_square_to_next;
            let moved = OffsetElement::Line(end, direction);
            return Ok(PreviousElement { moved, direction, index, bend: 0.0, entry: square_to_next });
        };
        let (_, direction) = directions(element, flat);
        moved_element(active, element, flat)?;
        let end = offset(q, direction, active);
        // The centre of the entry arc lies on the normal at its end, as far from there as from the start.
        let normal = unit([flat(centre)[0] - end[0], flat(centre)[1] - end[1]]);
        let back = [from[0] - end[0], from[1] - end[1]];
        let along = dot(back, normal);
        if along.abs() < SLACK {
            return Err("the entry arc of radius compensation cannot be made");
        }
        let length = dot(back, back) / (2.0 * along);
        let middle = [end[0] + length * normal[0], end[1] + length * normal[1]];
        let (to, middle3) = (self.lift(end, element.to), self.lift(middle, self.place.tool));
        let turned = sweep(self.modal.plane, self.place.tool, to, middle3, angle < 0.0, 1.0);
        self.tool_to(kind, Curve::Arc(Arc::new(self.modal.plane, self.place.tool, to, middle3, turned)));
        Ok(PreviousElement {
            moved: OffsetElement::Circle(middle, length.abs()),
            direction,
            index,
            bend: angle.signum(),
            entry: false,
        })
    }

    fn round_corner(&mut self, active: Active, kind: MoveKind, corner: Vec3, to: Point, angle: f64) {
        let to = self.lift(to, self.place.tool);
        let centre = corner;
        let curve = if kind == MoveKind::Rapid || active.radius < 1e-9 {
            Curve::Line { from: self.place.tool, to }
        } else {
            Curve::Arc(Arc::new(self.modal.plane, self.place.tool, to, centre, angle))
        };
        self.tool_to(kind, curve);
    }

    fn follow_moved(
        &mut self,
        active: Active,
        kind: MoveKind,
        element: Element,
        moved: OffsetElement,
    ) -> Result<(), Refusal> {
        let (a, b, _) = self.modal.plane.axes();
        let flat = |p: Vec3| [p[a], p[b]];
        let plane = self.modal.plane;
        let (_, end_direction) = directions(element, flat);
        let end = self.lift(offset(flat(element.to), end_direction, active), element.to);
        let curve = match (moved, element.arc) {
            (OffsetElement::Circle(centre, _), Some((_, angle))) => {
                let centre = self.lift(centre, self.place.tool);
                let mut turned = sweep(plane, self.place.tool, end, centre, angle < 0.0, 1.0);
                turned += (angle.abs() / std::f64::consts::TAU - 1e-9).floor().max(0.0)
                    * std::f64::consts::TAU.copysign(angle);
                if turned.abs() > angle.abs() + 0.1 + JOINED_RAD {
                    return Err(GOUGE);
                }
                Curve::Arc(Arc::new(plane, self.place.tool, end, centre, turned))
            }
            (OffsetElement::Line(_, direction), _) => {
                let (from, to) = (flat(self.place.tool), flat(end));
                if dot([to[0] - from[0], to[1] - from[1]], direction) < -SLACK {
                    return Err(GOUGE);
                }
                Curve::Line { from: self.place.tool, to: end }
            }
            (OffsetElement::Circle(..), None) => Curve::Line { from: self.place.tool, to: end },
        };
        self.tool_to(kind, curve);
        Ok(())
    }

    /// Ends the element before the corner at `meeting`, and takes what follows it (moves in height only) there.
    fn cut_back(&mut self, before: PreviousElement, meeting: Point) -> Result<(), Refusal> {
        let (a, b, _) = self.modal.plane.axes();
        let shift = |p: Vec3| {
            let mut p = p;
            (p[a], p[b]) = (meeting[0], meeting[1]);
            p
        };
        for (offset, motion) in self.out.moves[before.index..].iter_mut().enumerate() {
            let curve = match (motion.curve(), before.moved) {
                (Curve::Line { to, .. }, _) if offset > 0 => Curve::Line { from: shift(to), to: shift(to) },
                (Curve::Line { from, to }, OffsetElement::Line(_, direction)) => {
                    if dot([meeting[0] - from[a], meeting[1] - from[b]], direction) < -SLACK {
                        return Err(GOUGE);
                    }
                    Curve::Line { from, to: shift(to) }
                }
                (Curve::Arc(arc), _) => {
                    let turned = sweep(arc.plane, arc.from, shift(arc.to), arc.centre, arc.sweep_rad < 0.0, 1.0);
                    if turned.abs() > arc.sweep_rad.abs() + SLACK {
                        return Err(GOUGE);
                    }
                    Curve::Arc(Arc::new(arc.plane, arc.from, shift(arc.to), arc.centre, turned))
                }
                (line, _) => line,
            };
            motion.set_curve(curve);
        }
        self.chain_heights(before.index);
        self.place.tool = shift(self.place.tool);
        Ok(())
    }

    /// Joins the moves in height after `first` end to end.
    fn chain_heights(&mut self, first: usize) {
        for index in first + 1..self.out.moves.len() {
            let start = self.out.moves[index - 1].curve().to();
            if let Curve::Line { to, .. } = self.out.moves[index].curve() {
                self.out.moves[index].set_curve(Curve::Line { from: start, to });
            }
        }
    }
}

/// A point of the contour, moved aside where the contour runs along `direction`.
fn offset(p: Point, direction: Point, active: Active) -> Point {
    let by = active.side * active.radius;
    [p[0] - by * direction[1], p[1] + by * direction[0]]
}

/// Directions of an element at its start and end.
fn directions(element: Element, flat: impl Fn(Vec3) -> Point) -> (Point, Point) {
    let (p, q) = (flat(element.from), flat(element.to));
    match element.arc {
        None => {
            let direction = unit([q[0] - p[0], q[1] - p[1]]);
            (direction, direction)
        }
        Some((centre, sweep)) => {
            let c = flat(centre);
            let tangent = |at: Point| {
                let radial = unit([at[0] - c[0], at[1] - c[1]]);
                if sweep > 0.0 { [-radial[1], radial[0]] } else { [radial[1], -radial[0]] }
            };
            (tangent(p), tangent(q))
        }
    }
}

fn moved_element(active: Active, element: Element, flat: impl Fn(Vec3) -> Point) -> Result<OffsetElement, Refusal> {
    let (start, _) = directions(element, &flat);
    match element.arc {
        None => Ok(OffsetElement::Line(offset(flat(element.from), start, active), start)),
        Some((centre, sweep)) => {
            let radius = distance(flat(centre), flat(element.from));
            let inside = (sweep > 0.0) == (active.side > 0.0);
            if inside && radius <= active.radius {
                return Err("the arc is smaller than the tool");
            }
            Ok(OffsetElement::Circle(
                flat(centre),
                if inside { radius - active.radius } else { radius + active.radius },
            ))
        }
    }
}
