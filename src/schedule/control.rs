//! A model of the control: how it follows the blocks it is given. In: moves with commanded feeds, machine. Out: a chain of
//! primitives (what is left of each move, and the arcs that round its corners) whose exact pass is the realised motion.
//!
//! From one primitive to the next the control does one of three things. It stops: at an exact stop, between rapid and feed, where the path
//! turns back, at a kink of an exact path. Or, whichever is faster, it runs through the kink (the jump of velocity in one servo period may
//! take a share of the acceleration) or rounds the corner with an arc within the path tolerance. Along an arc √3/2 of the acceleration may
//! go into following the curve and half of it into changing speed. The control looks ahead over a number of primitives and must be able to
//! stop at the end of the last. The motion between two stops takes a whole number of servo periods.
//!
//! Rounding, kinks, short primitives and look-ahead follow LinuxCNC's trajectory planner (`tp.c`, `blendmath.c`), whose source is public.
//! With φ the angle turned, δ the tolerance and θ = (π − φ)/2, the arc takes d ≤ δ cos θ / (1 − sin θ) of both moves, at most half of
//! each; its radius is d tan θ, and it is made only as large as its speed needs.

use super::corner::{SERVO_S, along, speed_along};
use super::exact_pass::{Chain, Leg, leg_time_s};
use super::problem::FeedPiece;
use crate::ids::MoveId;
use crate::machine::Machine;
use crate::nc::{Event, Move, MoveKind, PathMode, Toolpath};
use crate::path::{Curve, Vec3};

/// Share of the acceleration for following an arc.
const NORMAL_SHARE: f64 = 0.866_025_403_784_438_6;
/// Share that is left for changing speed on it.
const TANGENT_SHARE: f64 = 0.5;
/// Share of the acceleration of a move that waits to be blended with the next: LinuxCNC plans parabolic blends with half of it
/// (`tcGetOverallMaxAccel`).
const UNBLENDED_SHARE: f64 = 0.5;
/// Cosine of the angle between two directions below which the path counts as turning back.
const TURN_BACK: f64 = -0.9987;
/// A line of which less than this many servo periods is left beside the arcs at its ends is taken into the arc that follows.
const GAP_CYCLES: f64 = 4.0;
/// Sine of the angle to the plane of an arc below which a move lies in it.
const FLAT: f64 = 1e-3;
/// Most primitives that wait to become legs, because the next ones may still change their ends.
const HELD: usize = 256;
/// Most points that are joined into one line.
const JOINED: usize = 100;
/// Part of a servo period that is rounding, not time.
const ROUNDING: f64 = 1e-6;

/// The properties in which controls differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Moves it looks ahead; `None`: as many as it needs.
    pub look_ahead: Option<usize>,
    /// Does it join short lines within the path tolerance (G64 P) before it plans?
    pub joins_lines: bool,
    /// Share of the acceleration that the jump of velocity at a kink may take.
    pub kink_share: f64,
    /// Does the share of a kink reduce the acceleration along both its moves?
    pub kink_slows: bool,
    /// Does the last move before a stop take half of the acceleration, where corners are rounded within a tolerance (G64 P)? It is
    /// kept ready to be blended with a next move, which does not come.
    pub slow_before_stop: bool,
    /// A primitive of a feed move that takes less than this time, s, goes straight from its first to its last speed and gets no faster in
    /// between.
    pub ramp_s: f64,
    /// In the servo period in which a primitive begins, does the control not look beyond its end? See [`super::first_period`].
    pub looks_late: bool,
    /// No real control but an upper bound for all of them: the feed may change anywhere, without a block.
    pub feed_changes_anywhere: bool,
}

impl Control {
    /// The control of a machine, by its dialect.
    pub fn of(machine: &Machine) -> Self {
        let linuxcnc = machine.dialect.as_deref() == Some("linuxcnc");
        // LinuxCNC: ARC_BLEND_KINK_RATIO, unless the machine's own file says otherwise.
        let kink_share = if linuxcnc { 0.1 } else { std::f64::consts::FRAC_1_SQRT_2 };
        let look_ahead = linuxcnc.then_some(50);
        // ARC_BLEND_RAMP_FREQ.
        let ramp_s = if linuxcnc { 0.01 } else { 0.0 };
        Self {
            look_ahead,
            joins_lines: linuxcnc,
            kink_share,
            kink_slows: linuxcnc,
            slow_before_stop: linuxcnc,
            ramp_s,
            looks_late: linuxcnc,
            feed_changes_anywhere: false,
        }
    }
}

/// The realised path.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Primitives as legs.
    pub chain: Chain,
    /// Move of each leg.
    pub moves: Vec<MoveId>,
    /// Legs whose time belongs to several moves, in order: (leg, move, share). An arc belongs half to either of its moves, a
    /// line that was joined from several to them by their lengths.
    pub shared: Vec<(u32, MoveId, f64)>,
}

/// Seconds of each of `count` moves, from the seconds of each leg of a plan.
pub fn seconds_of_moves(plan: &Plan, leg_s: impl Iterator<Item = f64>, count: usize) -> Vec<f64> {
    let mut move_s = vec![0.0; count];
    let mut shared = plan.shared.iter().peekable();
    for (leg, (seconds, id)) in leg_s.zip(&plan.moves).enumerate() {
        let mut alone = true;
        while let Some((_, of, share)) = shared.next_if(|(l, ..)| *l as usize == leg) {
            move_s[of.ix()] += share * seconds;
            alone = false;
        }
        if alone {
            move_s[id.ix()] += seconds;
        }
    }
    move_s
}

/// One primitive before its corners are known.
#[derive(Debug, Clone, Copy)]
struct Primitive {
    move_id: MoveId,
    rapid: bool,
    arc_radius_mm: Option<f64>,
    /// Normal of the plane of a flat arc.
    normal: Option<Vec3>,
    start: Vec3,
    end: Vec3,
    from: Vec3,
    nominal_mm: f64,
    length_mm: f64,
    feed: f64,
    speed: f64,
    accel: f64,
    mode: PathMode,
    /// Share of the acceleration that kinks at its ends take.
    kink: f64,
}

/// How the control goes from one primitive to the next.
enum Junction {
    Stop { share: f64 },
    Kink { speed: f64, share: f64 },
    Arc { speed: f64, trim_mm: f64, length_mm: f64 },
}

/// Plans the whole program. `pieces_of` gives the pieces of a feed move.
pub fn plan(
    toolpath: &Toolpath,
    machine: &Machine,
    control: &Control,
    pieces_of: &mut dyn FnMut(MoveId, &mut Vec<FeedPiece>),
) -> Plan {
    let rules = Rules { machine, control };
    let mut planner = Planner { rules, plan: Plan::default(), run: Vec::with_capacity(HELD) };
    planner.plan.chain.point_b.push(0.0);
    let mut pieces = Vec::new();
    for event in toolpath.events() {
        let Event::Move(id) = event else {
            planner.flush();
            continue;
        };
        let motion = &toolpath.moves[id.ix()];
        pieces.clear();
        match motion.kind {
            MoveKind::Rapid => {
                pieces.push(FeedPiece::commanded(id, [0.0, motion.curve().length()], machine.rapid_mm_s));
            }
            MoveKind::Feed => pieces_of(id, &mut pieces),
        }
        planner.add(motion, &pieces);
    }
    planner.flush();
    look_ahead(&mut planner.plan, control);
    planner.plan
}

/// How a control moves a machine.
#[derive(Clone, Copy)]
struct Rules<'a> {
    machine: &'a Machine,
    control: &'a Control,
}

struct Planner<'a> {
    rules: Rules<'a>,
    plan: Plan,
    /// Primitives since the last stop that have not become legs yet. Further lines may be joined to the last of them.
    run: Vec<Linked>,
}

/// A primitive in the run between two stops.
struct Linked {
    primitive: Primitive,
    /// Points inside it, where it was joined.
    joined: Vec<Vec3>,
    /// Moves it was joined from with their lengths, mm.
    owners: Vec<(MoveId, f64)>,
    /// Highest speed at its beginning.
    entry: f64,
    /// The arc before it: length and acceleration, and the move before that.
    arc: Option<(f64, f64, MoveId)>,
}

impl Planner<'_> {
    fn add(&mut self, motion: &Move, pieces: &[FeedPiece]) {
        let whole_mm = motion.curve().length();
        let last = pieces.iter().rposition(|piece| piece.to_mm > piece.from_mm);
        for (i, piece) in pieces.iter().enumerate().filter(|(_, piece)| piece.to_mm > piece.from_mm) {
            let mut primitive = self.rules.primitive(motion, piece, whole_mm);
            if Some(i) != last && motion.path_mode == PathMode::ExactStop {
                primitive.mode = PathMode::ExactPath;
            }
            if !self.join(&primitive) {
                self.close();
                let (joined, owners) = (Vec::new(), Vec::new());
                self.run.push(Linked { primitive, joined, owners, entry: 0.0, arc: None });
            }
        }
    }

    /// Joins a line to the one before it where the control does so: every point joined so far stays within the tolerance of
    /// the line from the first to the new end, and at most [`JOINED`] are kept.
    fn join(&mut self, next: &Primitive) -> bool {
        let Some(Linked { primitive: last, joined, owners, .. }) = self.run.last_mut() else { return false };
        let PathMode::Tolerance(tolerance_mm) = last.mode else { return false };
        let lines = last.arc_radius_mm.is_none() && next.arc_radius_mm.is_none() && !last.rapid && !next.rapid;
        if !self.rules.control.joins_lines || !lines || last.feed != next.feed || joined.len() >= JOINED {
            return false;
        }
        let corner = last.from + last.start * last.nominal_mm;
        let chord = next.from + next.start * next.nominal_mm - last.from;
        let off = |point: &Vec3| {
            let along = ((point - last.from).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            (point - last.from - chord * along).norm()
        };
        let length = chord.norm();
        if length <= 0.0 || joined.iter().chain([&corner]).any(|point| off(point) > tolerance_mm) {
            return false;
        }
        joined.push(corner);
        if joined.len() == 1 {
            owners.push((last.move_id, last.nominal_mm));
        }
        owners.push((next.move_id, next.nominal_mm));
        (last.start, last.end) = (chord / length, chord / length);
        (last.nominal_mm, last.length_mm) = (length, length);
        (last.move_id, last.mode) = (next.move_id, next.mode);
        let axes = &self.rules.machine.axes;
        let digest = self.rules.machine.block_time_s.max(SERVO_S);
        last.speed = last.feed.min(speed_along(axes, last.start)).min(length / digest);
        last.accel = along(axes, last.start);
        true
    }

    /// Ends the joining of lines to the last primitive; the one before it now has both its junctions.
    fn close(&mut self) {
        if let [.., before, after] = &mut self.run[..] {
            self.rules.link(before, after);
        }
        if self.run.len() >= HELD {
            let done = self.run.len() - 1;
            self.run.drain(..done).for_each(|run| self.plan.put(&run));
        }
    }

    /// Turns the waiting primitives into legs, at a stop.
    fn flush(&mut self) {
        self.close();
        if let Some(Linked { primitive: last, .. }) = self.run.last_mut() {
            // Measured with a tolerance (G64 P); not without one.
            let rounds = matches!(last.mode, PathMode::Tolerance(_));
            last.accel *= if rounds && self.rules.control.slow_before_stop { UNBLENDED_SHARE } else { 1.0 };
        }
        self.run.drain(..).for_each(|run| self.plan.put(&run));
        if let Some(b) = self.plan.chain.point_b.last_mut() {
            *b = 0.0;
        }
    }
}

impl Plan {
    /// The legs of a primitive whose junctions are known.
    fn put(&mut self, run: &Linked) {
        let Linked { primitive, owners, entry, arc, .. } = run;
        if let Some((length_mm, accel, before)) = *arc {
            let leg = self.moves.len() as u32;
            let first = owners.first().map_or(primitive.move_id, |owner| owner.0);
            self.shared.extend([before, first].map(|id| (leg, id, 0.5)));
            self.push(primitive.move_id, length_mm, *entry, accel, *entry);
        }
        let whole_mm: f64 = owners.iter().map(|owner| owner.1).sum();
        let leg = self.moves.len() as u32;
        self.shared.extend(owners.iter().map(|owner| (leg, owner.0, owner.1 / whole_mm)));
        let accel = primitive.accel * (1.0 - primitive.kink);
        let (speed, accel) = match primitive.arc_radius_mm {
            Some(radius) => (primitive.speed.min((NORMAL_SHARE * accel * radius).sqrt()), TANGENT_SHARE * accel),
            None => (primitive.speed, accel),
        };
        self.push(primitive.move_id, primitive.length_mm.max(0.0), speed, accel, *entry);
    }

    /// One leg; `entry` is the highest speed at its beginning.
    fn push(&mut self, id: MoveId, ds_mm: f64, speed: f64, accel_mm_s2: f64, entry: f64) {
        if let Some(b) = self.chain.point_b.last_mut() {
            *b = b.min(entry * entry);
        }
        let cap_b = speed * speed;
        let leg = Leg { ds_mm, cap_b, accel_mm_s2, jerk_mm_s3: f64::INFINITY, first_row: 0, row_count: 0 };
        self.chain.legs.push(leg);
        self.chain.point_b.push(f64::INFINITY);
        self.moves.push(id);
    }
}

impl Rules<'_> {
    fn primitive(&self, motion: &Move, piece: &FeedPiece, whole_mm: f64) -> Primitive {
        let axes = &self.machine.axes;
        let (start, end) = (motion.curve().tangent(piece.from_mm), motion.curve().tangent(piece.to_mm));
        let length_mm = piece.to_mm - piece.from_mm;
        let digest = self.machine.block_time_s.max(SERVO_S);
        let wanted = if piece.feed_mm_s > 0.0 { piece.feed_mm_s } else { self.machine.rapid_mm_s };
        let mut primitive = Primitive {
            move_id: piece.move_id,
            rapid: motion.kind == MoveKind::Rapid,
            arc_radius_mm: None,
            normal: None,
            start,
            end,
            from: motion.curve().point(piece.from_mm),
            nominal_mm: length_mm,
            length_mm,
            feed: piece.feed_mm_s,
            speed: wanted.min(speed_along(axes, start)).min(whole_mm / digest),
            accel: along(axes, start),
            mode: motion.path_mode,
            kink: 0.0,
        };
        if let Curve::Arc(_) = motion.curve() {
            let curvature = motion.curve().curvature(piece.from_mm);
            let moving = |axis: &usize| start[*axis].abs() > 1e-9 || curvature[*axis].abs() > 1e-12;
            let least = |value: &dyn Fn(usize) -> f64| (0..3).filter(moving).map(value).fold(f64::INFINITY, f64::min);
            primitive.accel = least(&|axis| axes[axis].acceleration_mm_s2);
            let radius = 1.0 / curvature.norm().max(1e-12);
            let cap = (NORMAL_SHARE * primitive.accel * radius).sqrt();
            primitive.speed = primitive.speed.min(cap).min(least(&|axis| axes[axis].velocity_mm_s));
            primitive.arc_radius_mm = Some(radius);
            primitive.normal = Some(start.cross(&curvature).normalize());
        }
        primitive
    }

    /// Chooses how the control goes from one primitive to the next, and shortens or slows both accordingly.
    fn link(&self, before: &mut Linked, after: &mut Linked) {
        let (a, b) = (&mut before.primitive, &mut after.primitive);
        match self.junction(a, b) {
            Junction::Stop { share } => self.reserve([a, b], share),
            Junction::Kink { speed, share } => {
                after.entry = speed;
                self.reserve([a, b], share);
            }
            Junction::Arc { speed, trim_mm, length_mm } => {
                after.arc = Some((length_mm, TANGENT_SHARE * a.accel.min(b.accel), a.move_id));
                after.entry = speed;
                a.length_mm -= trim_mm;
                b.length_mm -= trim_mm;
                if a.arc_radius_mm.is_none() && a.length_mm < GAP_CYCLES * SERVO_S * speed {
                    a.speed = a.speed.min(speed);
                    a.accel *= TANGENT_SHARE;
                }
            }
        }
    }

    /// Takes the share of a kink away from the acceleration of both its primitives.
    fn reserve(&self, pair: [&mut Primitive; 2], share: f64) {
        if self.control.kink_slows {
            for primitive in pair {
                primitive.kink = primitive.kink.max(share);
            }
        }
    }

    fn junction(&self, a: &Primitive, b: &Primitive) -> Junction {
        let cos = a.end.dot(&b.start);
        if a.mode == PathMode::ExactStop || a.rapid != b.rapid || cos < TURN_BACK {
            return Junction::Stop { share: 0.0 };
        }
        let most = self.control.kink_share;
        let (kink_speed, share) = self.kink(a, b);
        if share < most {
            return Junction::Kink { speed: kink_speed, share };
        }
        let tolerance_mm = match a.mode {
            PathMode::Tolerance(tolerance_mm) => tolerance_mm,
            PathMode::Continuous => self.machine.corner_tolerance_mm,
            PathMode::ExactPath | PathMode::ExactStop => return Junction::Stop { share: most },
        };
        // An arc is rounded only within its own plane.
        let flat = [(a.normal, b.start), (b.normal, a.end)]
            .iter()
            .all(|(normal, other)| normal.is_none_or(|normal| normal.dot(other).abs() < FLAT));
        match rounded(a, b, cos, tolerance_mm).filter(|_| flat) {
            Some((speed, trim_mm, length_mm)) if speed >= kink_speed => Junction::Arc { speed, trim_mm, length_mm },
            _ => Junction::Kink { speed: kink_speed, share: most },
        }
    }

    /// Speed through a kink and the share of the acceleration it takes (at full speed; the most it may take when it is slower).
    fn kink(&self, a: &Primitive, b: &Primitive) -> (f64, f64) {
        let speed = a.speed.min(b.speed);
        let change = b.start - a.end;
        let jump = speed / SERVO_S + b.accel;
        let axes = &self.machine.axes;
        let mut share = (0..3).map(|i| change[i].abs() * jump / axes[i].acceleration_mm_s2).fold(0.0, f64::max);
        if a.arc_radius_mm.or(b.arc_radius_mm).is_some() {
            share /= TANGENT_SHARE;
        }
        let most = self.control.kink_share;
        if share < most { (speed, share) } else { (speed * most / share, most) }
    }
}

/// Speed, length taken from both moves, and length of the arc that rounds a corner.
fn rounded(a: &Primitive, b: &Primitive, cos: f64, tolerance_mm: f64) -> Option<(f64, f64, f64)> {
    let phi = cos.clamp(-1.0, 1.0).acos();
    let theta = 0.5 * (std::f64::consts::PI - phi);
    let tolerance = tolerance_mm.min(0.25 * a.nominal_mm.min(b.nominal_mm));
    let by_tolerance = tolerance * theta.cos() / (1.0 - theta.sin());
    let reach = |p: &Primitive, share: f64| match p.arc_radius_mm {
        Some(radius) => (share * p.nominal_mm).min(theta * radius),
        None => 0.5 * p.nominal_mm,
    };
    let d = by_tolerance.min(reach(a, 2.0 / 3.0).min(a.length_mm)).min(reach(b, 1.0 / 3.0));
    let radius = d * theta.tan();
    let accel = a.accel.min(b.accel);
    let speed = (NORMAL_SHARE * accel * radius).sqrt().min(a.speed.max(b.speed));
    // As large as the speed needs, or as a parabolic blend of the same moves would take.
    let slow = 0.5 * accel;
    let blend = ((2.0 * slow * d).sqrt().min(speed) / slow * speed / phi).min(radius);
    let radius = (speed * speed / (NORMAL_SHARE * accel)).max(blend);
    (radius > 1e-6).then(|| (speed, radius / theta.tan(), radius * phi))
}

/// From any point the control must be able to stop within the moves it has looked at.
fn look_ahead(plan: &mut Plan, control: &Control) {
    let Some(depth) = control.look_ahead else { return };
    let legs = &plan.chain.legs;
    let mut room = vec![0.0; legs.len() + 1];
    for (i, leg) in legs.iter().enumerate() {
        room[i + 1] = room[i] + 2.0 * leg.accel_mm_s2 * leg.ds_mm;
    }
    let mut blocks = vec![0usize; legs.len() + 1];
    for i in 0..legs.len() {
        let piece = || !control.feed_changes_anywhere && legs[i].cap_b != legs[i - 1].cap_b;
        let new = i == 0 || plan.moves[i] != plan.moves[i - 1] || piece();
        blocks[i + 1] = blocks[i] + usize::from(new);
    }
    let mut end = 0;
    for i in 0..legs.len() {
        while end < legs.len() && blocks[end] < blocks[i] + depth {
            end += 1;
        }
        plan.chain.point_b[i] = plan.chain.point_b[i].min(room[end] - room[i]);
    }
}

/// Time of a leg of a plan between two values of b, s. A short leg that does not end at rest is a plain ramp from its first speed to its last, while
/// in a longer one the speed rises and falls again (`tpActivateSegment` in LinuxCNC's `tp.c`).
pub(super) fn time_of_leg(leg: &Leg, [from, to]: [f64; 2], ramps: bool, control: &Control) -> f64 {
    let ramp_s = 2.0 * leg.ds_mm / (from.sqrt() + to.sqrt());
    if ramps && ramp_s < control.ramp_s { ramp_s } else { leg_time_s(leg, from, to) }
}

/// Rounds the time between two stops up to whole servo periods: a motion ends within a period, and the next one begins with a new period.
/// The time lost is added to the last leg before the stop.
pub fn in_whole_periods(plan: &Plan, mut leg_s: Vec<f64>) -> Vec<f64> {
    let mut since = 0.0;
    for (seconds, next_b) in leg_s.iter_mut().zip(plan.chain.point_b.iter().skip(1)) {
        since += *seconds;
        if *next_b <= 0.0 {
            *seconds += (since / SERVO_S - ROUNDING).ceil() * SERVO_S - since;
            since = 0.0;
        }
    }
    leg_s
}
