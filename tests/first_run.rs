//! The first five minutes: `feedwright part.nc`, `init`, `tools import`. Programs and libraries are written here, in the styles of
//! posts and of tool libraries.

#![allow(clippy::unwrap_used)]

use assert_cmd::Command;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A facing pass and two holes as a post of Fusion writes them; the header tells the tools, not the stock.
const PROGRAM: &str = "%\nO1000 (PART)\n(T1 D=10. CR=0. - ZMIN=-4. - FLAT END MILL)\n(T2 D=5. CR=0. TAPER=118DEG - ZMIN=-12. - DRILL)\n\
    G90 G94 G17\nG21\nT1 M6\nS8000 M3\nG54\nG0 X-10 Y5 Z5\nG1 Z-4 F300\nX110 F800\nG0 Z5\nT2 M6\nS3000 M3\nG0 X20 Y20 Z5\n\
    G98 G81 X20 Y20 Z-12 R2 F200\nX40\nG80\nG0 Z50\nM30\n%\n";

struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(TempDir::new().unwrap());
        bench.put("part.nc", PROGRAM.as_bytes());
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(self.0.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Exit code, standard output, standard error.
    fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::cargo_bin("feedwright").unwrap();
        let output = command.current_dir(self.0.path()).args(arguments).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    }
}

#[test]
fn a_program_alone_names_what_it_lacks_and_writes_nothing() {
    let bench = Bench::new();
    let (code, _, said) = bench.run(&["part.nc"]);
    assert_eq!(code, 2, "{said}");
    for word in
        ["material of the stock", "box of the stock", "flutes of T1", "--material", "--stock", "--tool \"T1", "init"]
    {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert!(!said.contains("flutes of T2"), "a drill needs no count: {said}");
    assert!(said.contains("feedwright part.nc --material"), "{said}");
    assert_eq!(bench.names(), ["part.nc"]);
    // What is to be typed can be typed.
    bench.put("my part.nc", PROGRAM.as_bytes());
    let (code, _, said) = bench.run(&["my part.nc"]);
    assert!(code == 2 && said.contains("feedwright \"my part.nc\" --material"), "{said}");
    assert!(said.contains("feedwright init \"my part.nc\""), "{said}");
}

#[test]
fn what_is_lacking_can_be_said_and_the_second_run_needs_nothing() {
    let bench = Bench::new();
    let said = ["part.nc", "--material", "7075", "--stock", "X0 Y0 Z-20 X100 Y60 Z0", "--tool", "T1 3 flutes"];
    let (code, shown, errors) = bench.run(&said);
    assert_eq!(code, 0, "{shown}{errors}");
    assert_eq!(bench.names(), ["part.fw.html", "part.fw.nc", "part.nc", "part.setup.toml"]);
    assert!(shown.contains("reference loads"), "its own loads are the limit: {shown}");
    assert!(!shown.contains("-0.0 %"), "{shown}");
    let setup = bench.text("part.setup.toml");
    for line in [
        "material = \"aluminium\"  # --material: 7075",
        "diameter = 10  # line 3",
        "flutes = 3  # --tool",
        "# overhang = unknown",
    ] {
        assert!(setup.contains(line), "{line}: {setup}");
    }
    let (code, again, errors) = bench.run(&["part.nc", "--no-open"]);
    assert_eq!((code, again == shown), (0, true), "{again}{errors}");
    // A limit that the user wrote down is the limit from then on.
    bench.put("part.setup.toml", format!("{setup}\n[limits]\nforce_xy = 300\n").as_bytes());
    let (_, limited, _) = bench.run(&["part.nc"]);
    assert!(!limited.contains("reference loads"), "{limited}");
}

#[test]
fn a_draft_is_never_written_over_and_what_is_unknown_does_not_run() {
    let bench = Bench::new();
    let (code, _, said) = bench.run(&["init", "part.nc"]);
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("flutes of T1: count them"), "{said}");
    let draft = bench.text("part.setup.toml");
    assert!(draft.contains("# flutes = unknown: count them") && draft.contains("# box = unknown"), "{draft}");
    assert!(draft.parse::<toml::Table>().is_ok(), "{draft}");
    let (code, _, said) = bench.run(&["init", "part.nc"]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("--force") && bench.text("part.setup.toml") == draft, "{said}");
    // An unknown number has no value that runs in its place.
    let (code, _, said) = bench.run(&["optimize", "part.nc"]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("flutes") && said.contains("count its teeth"), "{said}");
    let complete = ["init", "part.nc", "-o", "-", "--material", "316", "--stock", "around", "--tool", "T1 3 flutes"];
    let (code, shown, said) = bench.run(&complete);
    assert_eq!(code, 0, "{said}");
    assert!(shown.contains("material = \"stainless\"") && !shown.contains("= unknown: count"), "{shown}");
    bench.put("other.toml", shown.as_bytes());
    assert_eq!(bench.run(&["simulate", "part.nc", "--setup", "other.toml"]).0, 0);
}

#[test]
fn what_is_no_program_is_said_and_no_setup_is_drafted_for_it() {
    let bench = Bench::new();
    bench.put("mesh.nc", b"solid part\nfacet normal 0 0 1\nendsolid\n");
    bench.put("notes.txt", b"Call the customer about the bracket.\nTwo pieces, by Friday.\n");
    bench.put("part.json", b"{\"tool\": 3}");
    for (name, words) in [("mesh.nc", "a mesh (STL)"), ("part.json", "JSON"), ("notes.txt", "no tool moves at a feed")]
    {
        for arguments in [&[name][..], &["init", name]] {
            let (code, _, said) = bench.run(arguments);
            assert!(code == 2 && said.contains(words), "{arguments:?}: {said}");
        }
    }
    assert_eq!(bench.names(), ["mesh.nc", "notes.txt", "part.json", "part.nc"]);
}

#[test]
fn what_makes_no_sense_is_refused_with_its_option() {
    let bench = Bench::new();
    for (arguments, words) in [
        (["init", "part.nc", "--material", "cheese"], "--material"),
        (["init", "part.nc", "--stock", "a lump"], "--stock"),
        (["init", "part.nc", "--tool", "T9 flat D10"], "T9"),
        (["init", "part.nc", "--machine", "toaster"], "haas-vf2"),
        (["init", "part.nc", "--tools", "absent.json"], "absent.json"),
    ] {
        let (code, _, said) = bench.run(&arguments);
        assert!(code == 2 && said.contains(words), "{arguments:?}: {said}");
    }
    assert_eq!(bench.names(), ["part.nc"]);
}

/// A library as Fusion exports it: a metric mill with its holder, an inch drill, a holder, and an entry without a unit.
const FUSION: &str = r#"{"data": [
 {"type": "flat end mill", "unit": "millimeters", "description": "10 mm rougher", "BMC": "carbide",
  "geometry": {"DC": 10, "NOF": 3, "LCF": 22, "LB": 35, "SFDM": 10, "OAL": 72},
  "holder": {"segments": [{"height": 20, "lower-diameter": 24, "upper-diameter": 32}, {"height": 30, "lower-diameter": 50, "upper-diameter": 50}]},
  "post-process": {"number": 1}},
 {"type": "drill", "unit": "inches", "description": "no. 9", "BMC": "hss", "geometry": {"DC": 0.196, "NOF": 2, "SIG": 118, "LCF": 2.0}, "post-process": {"number": 2}},
 {"type": "holder", "unit": "millimeters"},
 {"type": "flat end mill", "geometry": {"DC": 3}}
], "version": 36}"#;

fn zipped(path: &Path, json: &str) {
    let mut archive = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    archive.start_file("tools.json", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(json.as_bytes()).unwrap();
    archive.finish().unwrap();
}

#[test]
fn libraries_of_fusion_are_read_each_tool_in_its_unit() {
    let bench = Bench::new();
    bench.put("shop.json", FUSION.as_bytes());
    zipped(&bench.path("shop.tools"), FUSION);
    let (code, shown, said) = bench.run(&["tools", "import", "shop.json"]);
    assert_eq!(code, 0, "{said}");
    for line in [
        "number = 1\nshape = \"flat\"\ndiameter = \"10 mm\"\nflutes = 3\nflute_length = \"22 mm\"\noverhang = \"35 mm\"\n",
        "holder = [[\"32 mm\", \"20 mm\"], [\"50 mm\", \"30 mm\"]]",
        "diameter = \"0.196 in\"\nflutes = 2\npoint_angle = 118\n",
        "material = \"carbide\"",
    ] {
        assert!(shown.contains(line), "{line}: {shown}");
    }
    assert!(said.contains("entry 3") && said.contains("entry 4") && said.contains("unit"), "{said}");
    assert_eq!(bench.run(&["tools", "import", "shop.tools"]).1, shown);
    // What is printed is a setup's tools.
    let setup =
        format!("[stock]\nmaterial = \"aluminium\"\nbox = {{ min = [0, 0, -20], max = [100, 60, 0] }}\n{shown}");
    bench.put("part.setup.toml", setup.as_bytes());
    let (code, _, said) = bench.run(&["simulate", "part.nc"]);
    assert_eq!(code, 0, "{said}");
}

#[test]
fn a_library_completes_a_draft_and_a_contradiction_is_not_resolved_by_guess() {
    let bench = Bench::new();
    bench.put("shop.json", FUSION.as_bytes());
    let (_, shown, said) = bench.run(&["init", "part.nc", "--tools", "shop.json", "-o", "-"]);
    assert!(
        shown.contains("flutes = 3  # shop.json") && shown.contains("overhang = \"35 mm\"  # shop.json"),
        "{shown}"
    );
    assert!(!said.contains("of T1") && !said.contains("of T2"), "the drill's sizes agree within 2 %: {said}");
    bench.put("other.json", FUSION.replace("\"DC\": 10", "\"DC\": 12").as_bytes());
    let (code, shown, said) = bench.run(&["init", "part.nc", "--tools", "other.json", "-o", "-"]);
    assert_eq!(code, 1);
    assert!(said.contains("line 3 says a diameter of 10") && said.contains("12 mm"), "{said}");
    assert!(shown.contains("# diameter = unknown"), "{shown}");
}

#[test]
fn libraries_of_freecad_and_linuxcnc_are_read() {
    let bench = Bench::new();
    let bit = r#"{"version": 2, "name": "6 mm ball", "shape": "ballend.fcstd", "attribute": {"Flutes": "2", "Material": "Carbide"},
        "parameter": {"Diameter": "6.0000 mm", "CuttingEdgeHeight": "20.0000 mm", "ShankDiameter": "0.25 in"}}"#;
    bench.put("ball.fctb", bit.as_bytes());
    bench.put(
        "shop.fctl",
        br#"{"tools": [{"nr": 5, "path": "ball.fctb"}, {"nr": 6, "path": "gone.fctb"}], "version": 1}"#,
    );
    let (_, shown, said) = bench.run(&["tools", "import", "shop.fctl"]);
    let expected = "number = 5\nshape = \"ball\"\ndiameter = \"6 mm\"\nflutes = 2\nflute_length = \"20 mm\"\n\
        shank_diameter = \"0.25 in\"\nmaterial = \"carbide\"\n";
    assert!(shown.contains(expected), "{shown}");
    assert!(said.contains("gone.fctb is not beside"), "{said}");
    assert!(bench.run(&["tools", "import", "ball.fctb"]).1.contains("# number = unknown"));
    bench.put(
        "tool.tbl",
        b"T1 P1 D10.0 Z-50.2 ;flat end mill, 3 flutes\nT2 P2 D5 ;drill 118 deg point\n; a remark\nT3 P3 ;\n",
    );
    let (_, shown, _) = bench.run(&["tools", "import", "tool.tbl"]);
    assert!(shown.contains("number = 1\nshape = \"flat\"\ndiameter = \"10 mm\"\nflutes = 3\n"), "{shown}");
    assert!(
        shown.contains("number = 3\n# shape = unknown") && shown.contains("shape = \"drill\"\ndiameter = \"5 mm\""),
        "{shown}"
    );
    let (_, inches, _) = bench.run(&["tools", "import", "--inch", "tool.tbl"]);
    assert!(inches.contains("diameter = \"10 in\""), "{inches}");
}

#[test]
fn files_that_are_no_library_are_refused() {
    let bench = Bench::new();
    bench.put("broken.json", b"{\"data\": [");
    bench.put("list.json", b"{\"tools\": 3}");
    bench.put("empty.json", b"{\"data\": []}");
    bench.put("text.tools", b"not a zip");
    bench.put("note.fctb", b"{}");
    bench.put("a.xlsx", b"PK");
    for (name, words) in [
        ("broken.json", "not JSON"),
        ("list.json", "no list `data`"),
        ("empty.json", "holds no tool"),
        ("text.tools", "not a library of Fusion"),
        ("note.fctb", "no tool bit"),
        ("a.xlsx", "not read"),
    ] {
        let (code, _, said) = bench.run(&["tools", "import", name]);
        assert!(code == 2 && said.contains(words), "{name}: {said}");
    }
}

#[test]
fn a_dry_run_reports_and_writes_no_program() {
    let bench = Bench::new();
    bench.run(&["init", "part.nc", "--material", "316", "--stock", "around", "--tool", "T1 3 flutes"]);
    let (code, shown, said) = bench.run(&["optimize", "part.nc", "--dry-run", "--json", "r.json"]);
    assert_eq!(code, 0, "{said}");
    assert!(shown.contains("checked   only feeds differ") && said.contains("--dry-run"), "{shown}{said}");
    assert_eq!(bench.names(), ["part.nc", "part.setup.toml", "r.json"]);
    assert_eq!(bench.run(&["optimize", "part.nc"]).1, shown);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (code, shown, _) = bench.run(&["completions", shell]);
        let known = ["optimize", "init", "learn"].iter().all(|name| shown.contains(name));
        assert!(code == 0 && known, "{shell}: {shown}");
    }
    let (code, page, _) = bench.run(&["man"]);
    assert!(
        code == 0 && page.contains(".TH feedwright 1") && page.contains("Rewrite the feeds of a program"),
        "{page}"
    );
    assert_eq!(bench.run(&["completions", "cheese"]).0, 2);
}
