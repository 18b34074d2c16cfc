//! Toolpaths and jobs put together by hand for the engagement tests.
#![allow(dead_code)] // each test file uses its own part of it

pub mod brute;
pub mod oracle;
pub mod random;
pub mod ways;

use feedwright::engage::{EngagementMap, Options, Station, engage};
use feedwright::ids::{BlockId, MoveId};
use feedwright::machine::limits::Limits;
use feedwright::machine::material::{ForceModel, LinearEdge, Material, Process};
use feedwright::machine::{
    Annotate, Axis, Box3, Job, Machine, OutputRules, Profile, Raise, Shape, Spindle, Stock, StockShape, Table, Tool,
    Unsaid,
};
use feedwright::nc::toolpath::{Feed, State};
use feedwright::nc::{FeedMode, Move, MoveKind, PathMode, Spin, Toolpath};
use feedwright::path::{Arc, Curve, Plane, Vec3};

pub fn tool(number: u32, shape: Shape, profile: Profile) -> Tool {
    let diameter_mm = 2.0 * profile.max_radius();
    let length = profile.height();
    Tool {
        number,
        shape,
        profile,
        diameter_mm,
        flutes: 2,
        helix_rad: 0.5,
        pitch_rad: Vec::new(),
        rake_rad: 0.1,
        flute_length_mm: length,
        overhang_mm: length + 20.0,
        shank_diameter_mm: diameter_mm,
        flute_length_given: true,
        runout: None,
        youngs_modulus_mpa: 600_000.0,
        allowable_stress_mpa: None,
        holder_stiffness_n_mm: None,
        holder: Vec::new(),
        centre_cutting: true,
        coefficients: None,
        limits: Limits::default(),
        wear: None,
    }
}

pub fn flat(diameter: f64) -> Tool {
    tool(1, Shape::Flat, Profile::flat(diameter, 30.0))
}

pub fn ball(diameter: f64) -> Tool {
    tool(1, Shape::Ball, Profile::ball(diameter, 30.0))
}

pub fn bull(diameter: f64, corner: f64) -> Tool {
    tool(1, Shape::Bull, Profile::bull(diameter, corner, 30.0))
}

pub fn material() -> Material {
    let edge = LinearEdge { k_tc: 800.0, k_rc: 300.0, k_ac: 100.0, k_te: 15.0, k_re: 10.0, k_ae: 2.0 };
    Material { name: "test".into(), model: ForceModel::LinearEdge(edge), uncertainty: None }
}

pub fn block(min: [f64; 3], max: [f64; 3]) -> Stock {
    Stock {
        shape: StockShape::Box(Box3 { min: min.into(), max: max.into() }),
        offset: None,
        moved_mm: Vec3::zeros(),
        material: material(),
        uncertainty_mm: 0.0,
    }
}

pub fn job(tools: Vec<Tool>, stocks: Vec<Stock>) -> Job {
    let axis = Axis { velocity_mm_s: 200.0, acceleration_mm_s2: 1000.0, jerk_mm_s3: None };
    Job {
        log_columns: Vec::new(),
        machine: Machine {
            dialect: None,
            rapid_mm_s: 200.0,
            corner_tolerance_mm: 0.02,
            block_time_s: 0.002,
            tool_change_time_s: 5.0,
            home_mm: None,
            compensation: None,
            wear_mm: Vec::new(),
            tool_names: Vec::new(),
            max_line_length: None,
            max_repeated_bytes: feedwright::machine::MAX_REPEATED_BYTES,
            max_call_depth: feedwright::machine::MAX_CALL_DEPTH,
            axes: [axis; 3],
            spindle: Spindle {
                max_rps: 200.0,
                power_w: None,
                torque_nmm: None,
                tare_w: Table::constant(100.0),
                efficiency: Table::constant(0.9),
                runup_time_s: 1.0,
            },
            offsets: Vec::new(),
            unsaid: Unsaid::default(),
        },
        tools,
        stocks,
        fixtures: Vec::new(),
        fixtures_are_known: false,
        limits: Limits::default(),
        raise: Raise::default(),
        confirmed: Vec::new(),
        air_feed: None,
        wear: None,
        life: Vec::new(),
        confidence: None,
        operations: Vec::new(),
        references: Vec::new(),
        output: OutputRules {
            replace_computed_feeds: false,
            minimum_change: 0.05,
            max_growth: None,
            minimum_length_mm: 0.5,
            split: true,
            marked: true,
            annotate: Annotate::Changes,
            exclude: Vec::new(),
        },
        inch: false,
        cell_mm: None,
        process: Process::default(),
    }
}

/// A toolpath built move by move.
#[derive(Default)]
pub struct Path {
    pub toolpath: Toolpath,
    at: Option<Vec3>,
    tool: u32,
    state: Option<std::sync::Arc<State>>,
}

/// State of the control in which a tool cuts.
pub fn state(tool: u32) -> State {
    State {
        feed: Feed { mode: FeedMode::PerMinute, mm_s: 10.0, word: None, over_contour: 1.0 },
        spin: Spin { rps: 100.0, reverse: false },
        tool,
        wcs: 54,
        path_mode: PathMode::Continuous,
        shared: None,
        compensated: false,
        cycle: false,
        coolant: false,
    }
}

impl Path {
    pub fn from(start: [f64; 3]) -> Self {
        Self { at: Some(start.into()), tool: 1, ..Self::default() }
    }
    pub fn with_tool(mut self, number: u32) -> Self {
        self.tool = number;
        self
    }
    pub fn set_tool(&mut self, number: u32) {
        self.tool = number;
    }
    /// One state for moves that follow each other with one tool, as the interpreter keeps it.
    fn state(&mut self) -> std::sync::Arc<State> {
        let held = self.state.take().filter(|held| held.tool == self.tool);
        self.state.insert(held.unwrap_or_else(|| state(self.tool).into())).clone()
    }
    fn push(&mut self, kind: MoveKind, curve: Curve) {
        let index = self.toolpath.moves.len() as u32;
        self.at = Some(curve.to());
        let made = Move::new(BlockId(index), kind, curve, self.state());
        self.toolpath.moves.push(made);
    }
    pub fn line(&mut self, to: [f64; 3]) -> &mut Self {
        let from = self.at.unwrap();
        self.push(MoveKind::Feed, Curve::Line { from, to: to.into() });
        self
    }
    pub fn rapid(&mut self, to: [f64; 3]) -> &mut Self {
        let from = self.at.unwrap();
        self.push(MoveKind::Rapid, Curve::Line { from, to: to.into() });
        self
    }
    pub fn arc(&mut self, plane: Plane, to: [f64; 3], centre: [f64; 3], sweep_rad: f64) -> &mut Self {
        let from = self.at.unwrap();
        self.push(MoveKind::Feed, Curve::Arc(Arc::new(plane, from, to.into(), centre.into(), sweep_rad)));
        self
    }
    /// Full or partial turn in XY about (x, y).
    pub fn turn(&mut self, centre: [f64; 2], sweep_rad: f64, rise: f64) -> &mut Self {
        let from = self.at.unwrap();
        let (x, y) = (from.x - centre[0], from.y - centre[1]);
        let (sin, cos) = sweep_rad.sin_cos();
        let to = [centre[0] + x * cos - y * sin, centre[1] + x * sin + y * cos, from.z + rise];
        self.arc(Plane::Xy, to, [centre[0], centre[1], from.z], sweep_rad)
    }
}

pub fn run(path: &Path, job: &Job, cell_mm: f64, spacing_mm: f64) -> EngagementMap {
    let options = Options { cell_mm: Some(cell_mm), spacing_mm, ..Options::default() };
    engage(&path.toolpath, job, &options, &|_| {}).unwrap()
}

/// Stations of a move.
pub fn stations(map: &EngagementMap, index: u32) -> &[Station] {
    map.stations_of(MoveId(index))
}

/// Removed volume of a move from its stations, mm³.
pub fn volume_of(map: &EngagementMap, index: u32) -> f64 {
    stations(map, index).iter().map(|s| f64::from(s.removal_area_mm2) * s.length_mm()).sum()
}

/// Plain G0/G1 in absolute millimetres, enough for the programs the simulator is checked on before anything reads NC.
pub fn plain_program(text: &str) -> Path {
    let mut path = Path::from([0.0, 0.0, 50.0]);
    let mut rapid = true;
    let mut at = [0.0, 0.0, 50.0];
    for line in text.lines() {
        let line = line.split(['(', ';']).next().unwrap().to_ascii_uppercase();
        let mut moved = false;
        let mut rest = line.as_str();
        while let Some(start) = rest.find(|c: char| c.is_ascii_alphabetic()) {
            let letter = rest.as_bytes()[start];
            let body = &rest[start + 1..];
            let end = body.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(body.len());
            if let Ok(value) = body[..end].trim().parse::<f64>() {
                match letter {
                    b'G' if value == 0.0 => rapid = true,
                    b'G' if value == 1.0 => rapid = false,
                    b'X' | b'Y' | b'Z' => {
                        at[(letter - b'X') as usize] = value;
                        moved = true;
                    }
                    _ => {}
                }
            }
            rest = &body[end..];
        }
        if moved {
            if rapid {
                path.rapid(at);
            } else {
                path.line(at);
            }
        }
    }
    path
}
