//! The page in a real browser: drawn, pointed at, clicked, turned, played, on a narrow screen, in the dark, without WebGL2; and served, by
//! its requests and in the browser. Needs
//! chromium, node and playwright-core (`.ci/run` installs them); says so where they are absent.

#![allow(clippy::unwrap_used, clippy::format_collect, clippy::print_stdout)]

use assert_cmd::cargo::CommandCargoExt;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const SETUP: &str = r#"
[machine]
dialect = "linuxcnc"
[stock]
material = "aluminium-6061-t6"
box = { min = [0, 0, -10], max = [60, 40, 0] }
[[tool]]
number = 1
shape = "flat"
diameter = 8
flutes = 3
overhang = 30
[limits]
force_xy = 180
"#;

/// Its comment would end the block of data and run, were it not escaped.
const PROGRAM: &str = "%\n(T1 ROUGH </script><script>alert(1)</script> & \"SLOT\")\nG21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X-6 Y10\nG0 Z2\nG1 Z-3 F300\nG1 X30 F600\nG2 X30 Y26 I0 J8\nG1 X-6\nG0 Z5\n(FINISH WALL)\nG0 X-6 Y34\nG1 Z-2 F300\nG1 X66 F500\nG0 Z20\nM5\nM30\n%\n";

/// The page of a program that `optimize` rewrites.
fn page(folder: &Path, program: &str, setup: &str) -> PathBuf {
    fs::write(folder.join("part.nc"), program).unwrap();
    fs::write(folder.join("part.setup.toml"), setup).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let done = command.current_dir(folder).args(["optimize", "part.nc", "--report", "r.html"]).output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    folder.join("r.html")
}

/// The data of a page.
fn data(html: &str) -> Value {
    let (_, rest) = html.split_once("id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn column<'a>(data: &'a Value, path: &str) -> &'a Vec<Value> {
    data.pointer(path).unwrap().as_array().unwrap()
}

#[test]
fn the_data_of_the_page_hang_together() {
    let dir = tempfile::tempdir().unwrap();
    let html = fs::read_to_string(page(dir.path(), PROGRAM, SETUP)).unwrap();
    assert!(!html.contains("<script>alert"), "text of the program became markup");
    assert_eq!(html.matches("</script>").count(), 2);
    // The name of the language of drawings is no address.
    let plain = html.replace("http://www.w3.org/2000/svg", "");
    let others = ["href=", "src=", "http://", "https://"];
    assert_eq!(others.iter().find(|other| plain.contains(**other)), None, "it needs another file");
    assert_eq!(
        html.split_once("<ol id=\"checks\">").unwrap().1.split_once("</ol>").unwrap().0.matches("<li>").count(),
        3
    );
    let data = data(&html);
    let samples = column(&data, "/samples/line").len();
    assert!(samples > 20);
    for (key, values) in data["samples"].as_object().unwrap() {
        assert_eq!(values.as_array().unwrap().len(), samples, "{key}");
    }
    let points = column(&data, "/points/x").len() as u64;
    for (from, to) in column(&data, "/samples/p0").iter().zip(column(&data, "/samples/p1")) {
        assert!(from.as_u64().unwrap() <= to.as_u64().unwrap() && to.as_u64().unwrap() < points);
    }
    // The half circle of radius 8 is drawn as one: its points lie on it, closely.
    let on_arc = column(&data, "/points/x").iter().zip(column(&data, "/points/y")).filter(|(x, y)| {
        let (x, y) = (x.as_f64().unwrap() - 30.0, y.as_f64().unwrap() - 18.0);
        x < -0.1 && ((x * x + y * y).sqrt() - 8.0).abs() < 1e-3
    });
    assert!(on_arc.count() >= 25);
    // Time ends where the moves end, and both texts are in the listing.
    let ends = |key: &str| column(&data, key).last().unwrap().as_f64().unwrap();
    let moves = |side: usize| -> f64 {
        column(&data, "/operations").iter().map(|one| one["time_s"][side].as_f64().unwrap()).sum()
    };
    assert!((ends("/samples/before_s") - moves(0)).abs() < 0.01 && (ends("/samples/after_s") - moves(1)).abs() < 0.01);
    let names: Vec<&str> = column(&data, "/operations").iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names.last().unwrap(), &"T1 FINISH WALL", "{names:?}");
    let listing = column(&data, "/listing");
    let old: String = listing.iter().map(|row| format!("{}\n", row[1].as_str().unwrap())).collect();
    assert_eq!(old, PROGRAM);
    let written = fs::read_to_string(dir.path().join("part.fw.nc")).unwrap();
    let new: String = listing
        .iter()
        .flat_map(|row| match row[2].as_array() {
            Some(lines) => lines.iter().map(|line| format!("{}\n", line.as_str().unwrap())).collect::<Vec<_>>(),
            None => vec![format!("{}\n", row[1].as_str().unwrap())],
        })
        .collect();
    assert_eq!(new, written);
}

#[test]
fn a_machinist_reads_words_and_where_the_stock_is() {
    let dir = tempfile::tempdir().unwrap();
    // A cut at rapid: its fault is listed.
    let program = PROGRAM.replace("G1 X30 F600", "G0 X30");
    fs::write(dir.path().join("part.nc"), program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), SETUP).unwrap();
    let run = || {
        let mut command = Command::cargo_bin("feedwright").unwrap();
        let arguments = ["optimize", "part.nc", "--cache", "--report", "r.html", "--accept-collisions"];
        assert_eq!(command.current_dir(dir.path()).args(arguments).output().unwrap().status.code(), Some(1));
        fs::read_to_string(dir.path().join("r.html")).unwrap()
    };
    let first = run();
    let tables = first.split_once("<script").unwrap().0;
    for key in ["force_xy", "feed_change", "cut-at-rapid"] {
        assert!(!tables.contains(&format!(">{key}<")), "{key}");
    }
    assert!(tables.contains(">cutting force<") && tables.contains("<h2>Faults</h2>"));
    // What is not simulated again leaves no stock to show; the page has a sentence for it.
    assert!(!column(&data(&first), "/stock").is_empty());
    let again = run();
    assert!(column(&data(&again), "/stock").is_empty());
    assert!(again.contains("id=\"no-stock\" hidden>No stock is shown"));
}

#[test]
fn a_long_program_is_joined_and_its_largest_load_stays() {
    // A wave in 30,000 short blocks; somewhere in it one pass is deeper.
    let mut program =
        String::from("%\nG21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X0 Y10\nG0 Z2\nG1 Z-1 F300\nG1 X0.002 F600\n");
    for k in 1..=30_000 {
        let (x, deep) = (f64::from(k) * 0.002, if k == 17_000 { 1.2 } else { 1.0 });
        program += &format!("X{x:.3} Z-{deep:.3}\n");
    }
    program += "G0 Z20\nM30\n%\n";
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("part.nc"), &program).unwrap();
    fs::write(dir.path().join("part.setup.toml"), SETUP).unwrap();
    let mut command = Command::cargo_bin("feedwright").unwrap();
    let reports = ["simulate", "part.nc", "--report", "r.html", "--json", "r.json"];
    assert!(command.current_dir(dir.path()).args(reports).status().unwrap().success());
    let report: Value = serde_json::from_slice(&fs::read(dir.path().join("r.json")).unwrap()).unwrap();
    let data = data(&fs::read_to_string(dir.path().join("r.html")).unwrap());
    let samples = column(&data, "/samples/line").len();
    assert!((10_000..=20_000).contains(&samples), "{samples}");
    let largest = column(&data, "/loads/0/before").iter().filter_map(Value::as_f64).fold(0.0, f64::max);
    let known = report["limits"][0]["before_max"].as_f64().unwrap();
    assert!((largest / known - 1.0).abs() < 1e-3, "{largest} {known}");
}

#[test]
#[cfg_attr(absent_browser, ignore = "chromium, node or tests/browser/node_modules is not there")]
fn a_page_in_a_browser() {
    let dir = tempfile::tempdir().unwrap();
    let seen = seen(&page(dir.path(), PROGRAM, SETUP));
    assert_eq!(seen["noise"], serde_json::json!([]), "the browser complains");
    let many = |key: &str| seen[key].as_u64().unwrap();
    for canvas in ["above", "curves", "space", "dark_above", "above_without_webgl"] {
        assert!(many(canvas) > 12, "{canvas} is blank: {seen}");
    }
    for text in ["hover_above", "hover_curves"] {
        let text = seen[text].as_str().unwrap();
        let number: usize = text.strip_prefix("Line ").unwrap().split(',').next().unwrap().parse().unwrap();
        assert!(text.contains(PROGRAM.lines().nth(number - 1).unwrap()), "{text}");
    }
    assert!(
        many("clicked") >= 1
            && seen["hover_above"].as_str().unwrap().starts_with(&format!("Line {},", many("clicked_line")))
    );
    assert_eq!(many("checks"), 3);
    assert!(seen["verdict"].as_str().unwrap().contains("Within its limits"), "{seen}");
    for what in ["listing_moves_the_cursor", "turns", "without_webgl"] {
        assert_eq!(seen[what], true, "{what}: {seen}");
    }
    assert!(many("changed_rows") > 0 && (1..1000).contains(&many("played_to")), "{seen}");
    assert_eq!(seen["too_wide_at_400"], 0);
}

/// What a headless browser saw of a page.
fn seen(page: &Path) -> Value {
    in_browser("page.mjs", &[page.to_str().unwrap()])
}

fn in_browser(script: &str, arguments: &[&str]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser").join(script);
    let chromium = Command::new("sh").args(["-c", "command -v chromium"]).output().unwrap().stdout;
    let chromium = String::from_utf8(chromium).unwrap();
    let done = Command::new("node").arg(script).args(arguments).env("CHROMIUM", chromium.trim()).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

/// A folder that is served, until the end of the test.
struct Served {
    child: Child,
    /// Its address, with the token.
    url: String,
}

impl Served {
    fn of(folder: &Path) -> Self {
        let mut command = Command::cargo_bin("feedwright").unwrap();
        command.arg("serve").arg(folder).arg("--no-open").stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
        Self { child, url: url.trim().to_owned() }
    }

    /// "127.0.0.1:4711", and the token.
    fn place(&self) -> (&str, &str) {
        self.url.strip_prefix("http://").unwrap().trim_end_matches('/').split_once('/').unwrap()
    }

    /// Status, and all that was answered to a request as it is sent.
    fn raw(&self, request: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(self.place().0).unwrap();
        stream.write_all(request).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let status = String::from_utf8_lossy(&answer).split(' ').nth(1).map(|status| status.parse().unwrap());
        let body = answer.windows(4).position(|end| end == b"\r\n\r\n").map_or(answer.len(), |at| at + 4);
        (status.unwrap_or(0), answer[body..].to_vec())
    }

    /// The same of an address below the token.
    fn ask(&self, method: &str, target: &str, headers: &str, body: &str) -> (u16, String) {
        let (host, token) = self.place();
        let length = body.len();
        let head =
            format!("{method} /{token}/{target} HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n{headers}\r\n");
        let (status, body) = self.raw((head + body).as_bytes());
        (status, String::from_utf8_lossy(&body).into_owned())
    }

    fn get(&self, target: &str) -> (u16, String) {
        self.ask("GET", target, "", "")
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A folder with one program and its setup.
fn jobs() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let jobs = dir.path().join("jobs");
    fs::create_dir(&jobs).unwrap();
    fs::write(dir.path().join("secret.nc"), PROGRAM).unwrap();
    fs::write(jobs.join("part.nc"), PROGRAM).unwrap();
    fs::write(jobs.join("part.setup.toml"), SETUP).unwrap();
    dir
}

#[test]
fn a_folder_is_served_to_who_has_the_token_and_to_nobody_else() {
    let dir = jobs();
    let served = Served::of(&dir.path().join("jobs"));
    let (host, token) = served.place();
    assert!(host.starts_with("127.0.0.1:") && token.len() == 32, "{}", served.url);
    let (status, list) = served.get("");
    assert!(status == 200 && list.contains("href=\"program/part.nc\"") && !list.contains("secret"), "{list}");
    // Without the token, with a part of it, with another, from elsewhere, under another name.
    let ask = |target: &str, headers: &str| served.raw(format!("GET {target} HTTP/1.1\r\n{headers}\r\n").as_bytes());
    let here = format!("Host: {host}\r\n");
    for target in [
        "/".to_owned(),
        "/program/part.nc".into(),
        format!("/{}/", &token[1..]),
        format!("/{token}x/"),
        format!("/{}/", "0".repeat(32)),
    ] {
        let (status, body) = ask(&target, &here);
        assert!(status == 404 && !String::from_utf8_lossy(&body).contains(token), "{target}");
    }
    let page = format!("/{token}/");
    for headers in [
        "",
        "Host: evil.example\r\n",
        &format!("{here}Origin: https://evil.example\r\n"),
        &format!("{here}Origin: null\r\n"),
    ] {
        assert_eq!(ask(&page, headers).0, 403, "{headers}");
    }
    assert_eq!(ask(&page, &format!("{here}Origin: http://{host}\r\n")).0, 200);
    // No other file, by whatever name, and nothing but what is offered.
    for target in [
        "../secret.nc",
        "program/..%2Fsecret.nc",
        "program/%2e%2e/secret.nc",
        "program/%2Fetc%2Fpasswd",
        "program/..",
        "part.nc",
        "program/part.nc?setup=..%2Fsecret.nc",
    ] {
        let (status, body) = served.get(target);
        assert!(status >= 400 && !body.contains("SLOT"), "{target}: {status}");
    }
    assert_eq!(served.ask("DELETE", "program/part.nc", "", "").0, 404);
    assert_eq!(served.ask("POST", "program/part.nc", "", "x").0, 413);
    // Of bounded size: the head, and what is dropped (refused by its length, before it is sent).
    assert_eq!(served.get(&"a".repeat(40_000)).0, 431);
    let large = format!("POST /{token}/drop/a.nc HTTP/1.1\r\n{here}Content-Length: {}\r\n\r\n", (64 << 20) + 1);
    assert_eq!(served.raw(large.as_bytes()).0, 413);
    // It listens on this computer alone.
    let port: u16 = host.split_once(':').unwrap().1.parse().unwrap();
    let listens = fs::read_to_string("/proc/net/tcp").unwrap_or_default();
    let wide = format!("00000000:{port:04X} 00000000:0000 0A");
    assert!(!listens.contains(&wide));
    assert!(listens.is_empty() || listens.contains(&format!("0100007F:{port:04X} 00000000:0000 0A")));
}

#[test]
fn a_changed_limit_gives_the_feeds_that_optimize_gives_without_simulating() {
    let dir = jobs();
    let jobs = dir.path().join("jobs");
    let served = Served::of(&jobs);
    let before: Vec<_> = fs::read_dir(&jobs).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    let (status, first) = served.get("program/part.nc");
    assert!(
        status == 200 && first.contains("simulated") && first.contains("name=\"force_xy\" value=\"180\""),
        "{first}"
    );
    let (_, then) = served.get("program/part.nc?force_xy=110&T1.force_xy=");
    assert!(then.contains("its engagement was known") && then.contains("label class=\"changed\""));
    assert_ne!(data(&first)["listing"], data(&then)["listing"]);
    // The stock is shown, though nothing was simulated.
    assert_eq!(data(&first)["stock"], data(&then)["stock"]);
    assert!(!column(&data(&then), "/stock/0/heights").is_empty());
    // What is saved is what `optimize` writes under the setup that is saved with it.
    let link = |page: &str, what: &str| {
        let rest = page.split_once(&format!("../{what}/")).unwrap().1;
        format!("{what}/{}", rest.split_once('"').unwrap().0.replace("&amp;", "&"))
    };
    let (status, written) = served.get(&link(&then, "written"));
    assert_eq!(status, 200);
    let (_, setup) = served.get(&link(&then, "setup"));
    assert_eq!(setup, SETUP.replace("force_xy = 180", "force_xy = 110"));
    let alone = tempfile::tempdir().unwrap();
    page(alone.path(), PROGRAM, &setup);
    assert_eq!(written, fs::read_to_string(alone.path().join("part.fw.nc")).unwrap());
    // A program that changed meanwhile is not what was looked at.
    fs::write(jobs.join("part.nc"), PROGRAM.replace("F600", "F550")).unwrap();
    assert_eq!(served.get(&link(&then, "written")).0, 409);
    // What is typed wrong is said, with the form to put it right.
    let (status, wrong) = served.get("program/part.nc?force_xy=lots");
    assert!(status == 422 && wrong.contains("value=\"lots\"") && wrong.contains("force_xy"), "{wrong}");
    let after: Vec<_> = fs::read_dir(&jobs).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(before.len(), after.len(), "files were written: {after:?}");
}

#[test]
fn what_is_dropped_is_read_or_refused_in_words() {
    let dir = jobs();
    let served = Served::of(&dir.path().join("jobs"));
    let (status, to) = served.ask("POST", "drop/part.nc", "", &PROGRAM.replace("F600", "F400"));
    assert_eq!((status, to.as_str()), (200, "program/part-2.nc"));
    assert_eq!(fs::read_to_string(dir.path().join("jobs/part.nc")).unwrap(), PROGRAM);
    let (status, page) = served.get("program/part-2.nc");
    assert!(
        status == 422 && page.contains("there is no setup for part-2.nc") && page.contains("part.setup.toml"),
        "{page}"
    );
    let (status, page) = served.get("program/part-2.nc?setup=part.setup.toml");
    assert!(status == 200 && page.contains("F400"));
    let (status, said) = served.ask("POST", "drop/part.stl", "", "solid part\nfacet normal 0 0 1\nendsolid\n");
    assert!(status == 400 && !said.is_empty(), "{said}");
    let (status, said) = served.ask("POST", "drop/mesh.nc", "", "solid part\nfacet normal 0 0 1\nendsolid\n");
    assert!(status == 400 && said.contains("a mesh (STL)"), "{said}");
    assert_eq!(served.ask("POST", "drop/a.nc", "Origin: http://evil.example\r\n", PROGRAM).0, 403);
}

#[test]
#[cfg_attr(absent_browser, ignore = "chromium, node or tests/browser/node_modules is not there")]
fn a_served_page_in_a_browser() {
    let dir = jobs();
    let served = Served::of(&dir.path().join("jobs"));
    let other = dir.path().join("new part.nc");
    fs::write(&other, PROGRAM).unwrap();
    let seen = in_browser("serve.mjs", &[&served.url, other.to_str().unwrap()]);
    assert_eq!(seen["noise"], serde_json::json!([]), "the browser complains");
    assert_eq!(seen["programs"], serde_json::json!(["part.nc"]));
    assert_eq!(seen["programs_then"], serde_json::json!(["part.nc", "new part.nc"]));
    assert_eq!(seen["dropped"], "program/new part.nc");
    assert!(seen["first"]["took"].as_str().unwrap().contains("simulated"), "{seen}");
    assert!(seen["then"]["took"].as_str().unwrap().contains("its engagement was known"), "{seen}");
    assert_ne!(seen["first"]["changed"], seen["then"]["changed"]);
    assert_eq!(seen["marked"], serde_json::json!(["force_xy=110"]));
    assert_eq!(seen["saved_as"], "new part.fw.nc");
    assert!(seen["saved"].as_str().unwrap().contains("(FW "), "{seen}");
    println!("a limit changed: drawn anew after {} ms", seen["ms"]);
}
