//! The motion part of the proof. In: the toolpaths of both programs, and which line stands for which. Out: differences, and counts. Lines are
//! numbered through the program and its files here.
//!
//! Pieces of a block: each begins where the one before ends, the first begins and the last ends where the block did; split
//! points lie within half an increment of its path, everything between within one increment (an arc's centre is rounded
//! too), further along at each piece; arcs keep plane, sense, and centre (rounded) or radius, and their turns add up.

use crate::nc::{Event, FeedUse, Freeze, Move, MoveKind, Spin, Toolpath};
use crate::path::{Arc, Curve, Vec3};

use super::align::{Role, Roles};
use super::proof::{Proof, Rise};

/// Rounding of sums of coordinates, mm.
const SAME_MM: f64 = 1e-6;
/// Relative rounding of feeds.
const SAME_FEED: f64 = 1e-9;

/// Rounding of a coordinate that was an expression, mm: a tenth of the finest increment.
const UNROLLED_MM: f64 = 1e-4;
/// Relative rounding of a feed that was an expression.
const UNROLLED_FEED: f64 = 1e-6;

/// Compares all events in order, before and after rewriting. `keeps`: every frozen motion must have its old feed. False with the block-delete
/// switch on, where motions after a skipped one may be frozen only because their start is not known, which the writer, reading with the switch
/// off, cannot see; then only reasons in the text itself count.
pub fn compare([before, after]: &[Toolpath; 2], roles: &Roles, keeps: bool, proof: &mut Proof) {
    let mut rest = after.events();
    for event in before.events() {
        let here = rest.clone();
        let taken = match (event, rest.next()) {
            (Event::Move(id), Some(Event::Move(first))) => {
                let whole = &before.moves[id.ix()];
                let pieces = pieces(whole, here, after, roles);
                if pieces.len() > 1 {
                    compare_pieces(whole, &pieces, roles, proof);
                } else {
                    compare_moves(whole, &after.moves[first.ix()], roles, keeps, proof);
                }
                pieces.len().max(1)
            }
            (_, Some(other)) => {
                compare_events(&event, &other, roles, proof);
                1
            }
            (_, None) => {
                proof.differ(Some(line_of(&event, before)), None, "the rewritten program ends before this");
                return;
            }
        };
        for _ in 1..taken {
            rest.next();
        }
    }
    if let Some(event) = rest.next() {
        proof.differ(None, Some(line_of(&event, after)), "the rewritten program goes on where the original ends");
    }
    compare_feed_uses(&before.feed_uses, &after.feed_uses, proof);
}

/// The feed in force must be the old one wherever something that is not simulated may use it.
fn compare_feed_uses(before: &[FeedUse], after: &[FeedUse], proof: &mut Proof) {
    if before.len() != after.len() {
        return proof.differ(None, None, "the feed in force is used at other places");
    }
    for (a, b) in before.iter().zip(after) {
        if a.mode != b.mode || (a.value - b.value).abs() > SAME_FEED * a.value.abs() {
            let text = "another feed is in force where something that is not simulated may use it";
            proof.differ(Some(a.block.0 + 1), Some(b.block.0 + 1), text);
        }
    }
}

/// Compares a program with the plain text it was unrolled into: the same events in the same order, at the same feeds.
/// Expressions became decimals, so places may differ by [`UNROLLED_MM`].
pub fn compare_unrolled(before: &Toolpath, after: &Toolpath, proof: &mut Proof) {
    let mut others = after.events();
    for event in before.events() {
        let line = line_of(&event, before);
        let Some(other) = others.next() else {
            return proof.differ(Some(line), None, "the unrolled program ends before this");
        };
        if !same_unrolled(&event, &other, before, after) {
            return proof.differ(Some(line), Some(line_of(&other, after)), "the unrolled program does something else");
        }
    }
    if let Some(event) = others.next() {
        proof.differ(None, Some(line_of(&event, after)), "the unrolled program goes on where the original ends");
    }
}

fn same_unrolled(a: &Event, b: &Event, before: &Toolpath, after: &Toolpath) -> bool {
    match (a, b) {
        (Event::Move(a), Event::Move(b)) => {
            let (a, b) = (&before.moves[a.ix()], &after.moves[b.ix()]);
            let (from, to) = (a.curve(), b.curve());
            let near = |s: f64, t: f64| (from.point(s) - to.point(t)).amax() <= UNROLLED_MM;
            let (long, other) = (from.length(), to.length());
            let along = (0..=4).all(|k| near(long * f64::from(k) / 4.0, other * f64::from(k) / 4.0));
            let feed = a.kind == MoveKind::Rapid || (a.feed.mm_s - b.feed.mm_s).abs() <= UNROLLED_FEED * a.feed.mm_s;
            let state = same_spin(a.spin, b.spin) && other_words(a, b).is_none();
            a.kind == b.kind && along && (long - other).abs() <= UNROLLED_MM && feed && state
        }
        (Event::Dwell { seconds, .. }, Event::Dwell { seconds: other, .. }) => (seconds - other).abs() <= 1e-6,
        (Event::Tool { number, .. }, Event::Tool { number: other, .. }) => number == other,
        (Event::Spindle { spin, .. }, Event::Spindle { spin: other, .. }) => same_spin(*spin, *other),
        (Event::Stop { end, .. }, Event::Stop { end: other, .. }) => end == other,
        _ => false,
    }
}

/// The same speed but for the decimals of an S that was an expression.
fn same_spin(a: Spin, b: Spin) -> bool {
    a.reverse == b.reverse && (a.rps - b.rps).abs() <= UNROLLED_FEED * a.rps
}

fn line_of(event: &Event, toolpath: &Toolpath) -> u32 {
    match event {
        Event::Move(id) => toolpath.moves[id.ix()].block.0 + 1,
        Event::Dwell { line, .. }
        | Event::Tool { line, .. }
        | Event::Spindle { line, .. }
        | Event::Stop { line, .. } => *line,
    }
}

/// Line of the original that a line of the rewritten program stands for.
fn origin(line: u32, roles: &Roles) -> Option<u32> {
    match roles.of.get((line as usize).checked_sub(1)?)? {
        Role::Same(block) | Role::Piece(block) | Role::Last(block) => Some(block.0 + 1),
        Role::Added => None,
    }
}

fn compare_events(a: &Event, b: &Event, roles: &Roles, proof: &mut Proof) {
    let place = |line: &u32| origin(*line, roles);
    let (same, lines) = match (a, b) {
        (Event::Dwell { seconds, line }, Event::Dwell { seconds: other, line: at }) => {
            (seconds == other, Some((line, at)))
        }
        (Event::Tool { number, line }, Event::Tool { number: other, line: at }) => (number == other, Some((line, at))),
        (Event::Spindle { spin, line }, Event::Spindle { spin: other, line: at }) => (spin == other, Some((line, at))),
        (Event::Stop { end, line }, Event::Stop { end: other, line: at }) => (end == other, Some((line, at))),
        _ => (false, None),
    };
    if !same || lines.is_none_or(|(line, at)| place(at) != Some(*line)) {
        proof.differ(lines.map(|l| *l.0), lines.map(|l| *l.1), format!("{} became {}", name(a), name(b)));
    }
}

fn name(event: &Event) -> String {
    match event {
        Event::Move(_) => "a motion".to_owned(),
        Event::Dwell { seconds, .. } => format!("a dwell of {seconds} s"),
        Event::Tool { number, .. } => format!("tool {number}"),
        Event::Spindle { spin, .. } => {
            format!("spindle at {} rev/s{}", spin.rps, if spin.reverse { " reversed" } else { "" })
        }
        Event::Stop { .. } => "a stop".to_owned(),
    }
}

/// The motions that are the pieces of this one: one after the other, all but the last in the role of a piece.
fn pieces<'a>(whole: &Move, events: impl Iterator<Item = Event>, after: &'a Toolpath, roles: &Roles) -> Vec<&'a Move> {
    let mut out = Vec::new();
    for event in events {
        let Event::Move(id) = event else { break };
        let motion = &after.moves[id.ix()];
        out.push(motion);
        match roles.of.get(motion.block.ix()) {
            Some(Role::Piece(block)) if *block == whole.block => {}
            _ => break,
        }
    }
    out
}

fn compare_moves(a: &Move, b: &Move, roles: &Roles, keeps: bool, proof: &mut Proof) {
    let mut differ = |text: &str| proof.differ(Some(a.block.0 + 1), Some(b.block.0 + 1), text);
    if origin(b.block.0 + 1, roles) != Some(a.block.0 + 1) || a.kind != b.kind {
        differ("the motion is another");
    } else if !same_curve(&a.curve(), &b.curve()) {
        differ("the motion goes another way");
    } else if let Some(text) = other_state(a, b) {
        differ(text);
    } else if a.instance != b.instance || circumstances(a) != circumstances(b) {
        differ("the motion is made under other circumstances");
    } else if keeps && a.kind == MoveKind::Feed && keeps_by_its_text(a) && feed_differs(a, b) {
        differ("the feed of a motion changed that must keep its own");
    }
    proof.motions += 1;
    proof.feeds_changed += usize::from(a.kind == MoveKind::Feed && feed_differs(a, b));
    enter_rise(a, b, proof);
}

/// Records a motion that runs faster than before.
fn enter_rise(a: &Move, b: &Move, proof: &mut Proof) {
    let (was, is) = (a.feed.mm_s, b.feed.mm_s);
    if a.kind == MoveKind::Feed && b.kind == MoveKind::Feed && was > 0.0 && is > was && feed_differs(a, b) {
        let lines = [a.block.0 + 1, b.block.0 + 1];
        proof.rises.push(Rise { ratio: is / was, feeds_mm_s: [was, is], lines });
    }
}

/// Why a move is frozen, but for its feed: that may have become plain.
fn circumstances(motion: &Move) -> Option<Freeze> {
    motion.freeze.filter(|why| !matches!(why, Freeze::Expression))
}

/// Must the motion keep its feed for a reason that the text alone gives? What compensation and approaches mean is the setup's to say.
fn keeps_by_its_text(motion: &Move) -> bool {
    use Freeze::{Cycle, NoFeed, NotUnderstood, OtherFile, OwnFeed, Repeated, Rotary, SharedFeed};
    matches!(motion.freeze, Some(Cycle | Repeated | Rotary | NotUnderstood | NoFeed | OtherFile | OwnFeed | SharedFeed))
}

/// What besides path and kind must be as it was.
fn other_state(a: &Move, b: &Move) -> Option<&'static str> {
    if a.spin == b.spin { other_words(a, b) } else { Some("the spindle runs otherwise") }
}

/// What besides the speed of the spindle is another.
fn other_words(a: &Move, b: &Move) -> Option<&'static str> {
    let frozen = matches!(a.freeze, Some(Freeze::Synchronised | Freeze::Probe));
    if a.tool != b.tool || a.wcs != b.wcs {
        Some("tool or work offset is another")
    } else if a.path_mode != b.path_mode {
        Some("the path mode is another")
    } else if a.kind == MoveKind::Feed && a.feed.mode != b.feed.mode {
        Some("the unit of the feed is another")
    } else if frozen && feed_differs(a, b) {
        Some("the feed of a thread or probe changed")
    } else if a.kind == MoveKind::Feed && a.feed.mm_s > 0.0 && b.feed.mm_s <= 0.0 {
        Some("the motion has no feed any more")
    } else {
        None
    }
}

/// A feed that no plain F word set (FU, a variable) is that of its text, which is the same, whatever the F before it says.
fn feed_differs(a: &Move, b: &Move) -> bool {
    (a.feed.word.is_some() || b.feed.word.is_some())
        && (a.feed.mm_s - b.feed.mm_s).abs() > SAME_FEED * a.feed.mm_s.abs()
}

fn same_point(a: Vec3, b: Vec3) -> bool {
    (a - b).amax() <= SAME_MM
}

fn same_curve(a: &Curve, b: &Curve) -> bool {
    let arcs = match (a, b) {
        (Curve::Line { .. }, Curve::Line { .. }) => true,
        (Curve::Arc(a), Curve::Arc(b)) => {
            let reach = SAME_MM / a.radius_mm.max(SAME_MM) + 1e-12;
            a.plane == b.plane && same_point(a.centre, b.centre) && (a.sweep_rad - b.sweep_rad).abs() <= 4.0 * reach
        }
        _ => false,
    };
    arcs && same_point(a.from(), b.from()) && same_point(a.to(), b.to())
}

fn compare_pieces(whole: &Move, pieces: &[&Move], roles: &Roles, proof: &mut Proof) {
    let increment_mm = roles.increment_mm.get(whole.block.ix()).copied().unwrap_or(0.0);
    let line = pieces.first().map(|piece| piece.block.0 + 1);
    let own = Some(whole.block.0 + 1);
    if let Some(text) = wrong_pieces(whole, pieces, increment_mm) {
        proof.differ(own, line, text);
    }
    let last = pieces.last().is_some_and(|piece| matches!(roles.of.get(piece.block.ix()), Some(Role::Last(_))));
    if !last {
        proof.differ(own, line, "the pieces of the block do not end it");
    }
    proof.motions += 1;
    proof.feeds_changed += 1;
    for piece in pieces {
        enter_rise(whole, piece, proof);
    }
}

fn wrong_pieces(whole: &Move, pieces: &[&Move], increment_mm: f64) -> Option<&'static str> {
    let (first, last) = (pieces.first()?, pieces.last()?);
    let joined = pieces.windows(2).all(|pair| same_point(pair[0].curve().to(), pair[1].curve().from()));
    let feeds = pieces.iter().all(|piece| piece.kind == MoveKind::Feed && piece.freeze.is_none());
    if whole.kind != MoveKind::Feed || circumstances(whole).is_some() || !feeds {
        return Some("a motion that must stay whole is cut");
    }
    if !whole.splittable {
        return Some("a motion whose start or end is not known, or that the control makes of it, is cut");
    }
    if !joined
        || !same_point(first.curve().from(), whole.curve().from())
        || !same_point(last.curve().to(), whole.curve().to())
    {
        return Some("the pieces of the block do not join");
    }
    if let Some(text) = pieces.iter().find_map(|piece| other_state(whole, piece)) {
        return Some(text);
    }
    if !on_path(whole, pieces, increment_mm) {
        return Some("a piece leaves the path of its block");
    }
    None
}

fn on_path(whole: &Move, pieces: &[&Move], increment_mm: f64) -> bool {
    let length = whole.curve().length();
    let mut reached = 0.0;
    for (index, piece) in pieces.iter().enumerate() {
        let ends = piece.curve().length();
        let inside = |k: u32| piece.curve().point(ends * f64::from(k) / 8.0);
        let along = |point: Vec3, near: f64| foot(&whole.curve(), point, near);
        let near = |k: u32| reached + ends * f64::from(k) / 8.0;
        if (1..8).any(|k| along(inside(k), near(k)).1 > increment_mm + SAME_MM) {
            return false;
        }
        let (s, off) = along(piece.curve().to(), reached + ends);
        let is_last = index + 1 == pieces.len();
        if s <= reached || (!is_last && (off > 0.5 * increment_mm + SAME_MM || s >= length)) {
            return false;
        }
        reached = s;
    }
    turns_agree(&whole.curve(), pieces, increment_mm)
}

/// Place along the curve nearest to a point, looked for from `near_mm` on, and the distance there.
fn foot(curve: &Curve, point: Vec3, near_mm: f64) -> (f64, f64) {
    let length = curve.length();
    let mut s = near_mm.clamp(0.0, length);
    for _ in 0..6 {
        s = (s + (point - curve.point(s)).dot(&curve.tangent(s))).clamp(0.0, length);
    }
    (s, (point - curve.point(s)).norm())
}

fn turns_agree(whole: &Curve, pieces: &[&Move], increment_mm: f64) -> bool {
    match whole {
        Curve::Line { .. } => pieces.iter().all(|piece| matches!(piece.curve(), Curve::Line { .. })),
        Curve::Arc(arc) => {
            let mut sum = 0.0;
            for piece in pieces {
                let Curve::Arc(part) = &piece.curve() else { return false };
                let turned = part.plane != arc.plane || part.sweep_rad.signum() != arc.sweep_rad.signum();
                if turned || !about_the_same(arc, part, increment_mm) {
                    return false;
                }
                sum += part.sweep_rad;
            }
            let rounding = 2.0 * (pieces.len() as f64 + 1.0) * increment_mm / arc.radius_mm.max(increment_mm);
            (sum - arc.sweep_rad).abs() <= rounding + 1e-6
        }
    }
}

/// Is the centre that of the whole arc, rounded to the increment in each axis? An arc by its radius keeps that instead.
fn about_the_same(whole: &Arc, part: &Arc, increment_mm: f64) -> bool {
    let (a, b, _) = whole.plane.axes();
    let off = (part.centre[a] - whole.centre[a]).abs().max((part.centre[b] - whole.centre[b]).abs());
    off <= 0.5 * increment_mm + SAME_MM || (part.radius_mm - whole.radius_mm).abs() <= SAME_MM
}
