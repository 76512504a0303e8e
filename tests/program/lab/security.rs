//! Another origin, another host, no token, paths that lead elsewhere, names with markup: refused, or shown as text.

use super::program::{Lab, block};
use serde_json::json;
use std::fs;

#[test]
fn only_our_own_page_is_answered() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    let (host, token) = (lab.host(), lab.token.clone());
    let local = format!("localhost:{}", lab.port);
    let own = format!("http://{host}");
    let status = |headers: &[(&str, &str)]| lab.raw("GET /api/tree", headers, "").status;

    assert_eq!(status(&[("Host", &host), ("X-Token", &token)]), 200);
    assert_eq!(status(&[("Host", &local), ("X-Token", &token), ("Origin", &own)]), 200);
    for strange in ["evil.example", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example", ""] {
        assert_eq!(status(&[("Host", strange), ("X-Token", &token)]), 403, "host {strange:?}");
    }
    for strange in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1", "file://"] {
        assert_eq!(status(&[("Host", &host), ("X-Token", &token), ("Origin", strange)]), 403, "origin {strange:?}");
    }
    assert_eq!(status(&[("Host", &host)]), 401);
    assert_eq!(status(&[("Host", &host), ("X-Token", "0")]), 401);
    let shorter = &token[1..];
    assert_eq!(status(&[("Host", &host), ("X-Token", shorter)]), 401);
    let in_query = format!("GET /api/tree?token={token}");
    assert_eq!(lab.raw(&in_query, &[("Host", &host)], "").status, 200, "figures and events carry it so");

    // The page itself has no secret, but is of this host alone, too.
    assert_eq!(lab.raw("GET /", &[("Host", &host)], "").status, 200);
    assert_eq!(lab.raw("GET /", &[("Host", "evil.example")], "").status, 403);

    // A form of elsewhere cannot say that it sends JSON.
    let step = json!({ "parent": 1, "change": { "kind": "improve" } }).to_string();
    let form = [("Host", host.as_str()), ("X-Token", token.as_str()), ("Content-Type", "text/plain")];
    assert_eq!(lab.raw("POST /api/steps", &form, &step).status, 415);
    let without = [("Host", host.as_str()), ("Content-Type", "application/json")];
    assert_eq!(lab.raw("POST /api/steps", &without, &step).status, 401);
    assert_eq!(lab.get("steps").status, 405, "nothing changes by a GET");

    for path in ["GET /", "GET /api/tree", "GET /nowhere"] {
        let head = lab.raw(path, &[("Host", &host), ("X-Token", &token), ("Origin", &own)], "").head;
        assert!(head.contains("content-security-policy: default-src 'self'"), "{head}");
        assert!(head.contains("x-content-type-options: nosniff") && head.contains("referrer-policy: no-referrer"));
        assert!(!head.contains("access-control-"), "no other origin may read: {head}");
    }
}

#[test]
fn no_path_leads_out_of_the_page_or_of_a_step() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    lab.done(1);
    fs::write(folder.path().join("secret.txt"), "a secret").expect("a file");
    let host = lab.host();
    let headers = [("Host", host.as_str()), ("X-Token", lab.token.as_str())];
    let kept = folder.path().join("lab/step-0001/model.toml");
    let kept = kept.to_str().expect("UTF-8");
    for path in [
        "/../Cargo.toml",
        "/..%2fCargo.toml",
        "/%2e%2e/Cargo.toml",
        "/vendor/../../Cargo.toml",
        "//etc/passwd",
        "/etc/passwd",
        kept,
        "/api/nodes/1/..%2f..%2f..%2fsecret.txt",
        "/api/nodes/1/source.json",
        "/api/nodes/..%2f..%2f/report.html",
        "/api/nodes/1%2f..%2f1/report.html",
        "/api/nodes/0001x/model.toml",
        "/api/nodes/-1/model.toml",
        "/api/nodes/1/figures/..%2f..%2fmodel.toml",
        "/api/nodes/1/figures/sensor",
    ] {
        let answer = lab.raw(&format!("GET {path}"), &headers, "");
        assert_eq!(answer.status, 404, "{path}: {}", answer.text());
        assert!(!answer.text().contains("secret") || answer.text().starts_with("{\"error\""), "{path}");
        assert!(!answer.text().contains("[package]") && !answer.text().contains("a secret"), "{path}");
    }
    assert_eq!(lab.get("nodes/1/model.toml").status, 200);
    assert_eq!(lab.get("nodes/7/model.toml").status, 404);
}

#[test]
fn markup_in_names_is_text() {
    let folder = tempfile::tempdir().expect("a folder");
    let copy = folder.path().join("block");
    fs::create_dir(&copy).expect("a folder");
    let first = fs::read_to_string(block("received-1").join("images.csv")).expect("images");
    let name = first.lines().nth(1).and_then(|line| line.split(',').next()).expect("an image").to_string();
    let hostile = "<script>alert(1)</script>";
    for entry in fs::read_dir(block("received-1")).expect("a block").flatten() {
        let text = fs::read_to_string(entry.path()).expect("a table");
        let renamed: Vec<String> = text
            .lines()
            .map(|line| {
                line.split(',').map(|cell| if cell == name { hostile } else { cell }).collect::<Vec<_>>().join(",")
            })
            .collect();
        fs::write(copy.join(entry.file_name()), renamed.join("\n") + "\n").expect("a table");
    }
    let lab = Lab::open(&copy, &folder.path().join("lab"));
    lab.done(1);
    let answer = lab.get("nodes/1/figures/image.svg?image=0");
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert!(answer.text().contains("&lt;script&gt;alert(1)&lt;/script&gt;") && !answer.text().contains("<script"));
    assert!(answer.head.contains("content-type: image/svg+xml"));
    let block = lab.get("block");
    assert!(block.head.contains("content-type: application/json"));
    assert_eq!(block.json()["images"][0]["name"], hostile);
    // What is asked for comes back in errors: as JSON, which no browser runs.
    let answer = lab.get("nodes/1/predicted/%3Cscript%3E");
    assert_eq!(answer.status, 400);
    assert!(answer.head.contains("content-type: application/json"));
    let report = lab.get("nodes/1/report.html");
    assert!(report.head.contains("content-security-policy: default-src 'none'"), "{}", report.head);
    assert!(!report.text().contains("<script"));
    for (what, query) in
        [("a brush", "brush=%7B%7D"), ("a scale", "scale=-1"), ("an image", "image=9999"), ("a range", "y=1")]
    {
        let answer = lab.get(&format!("nodes/1/figures/image.svg?{query}"));
        assert_eq!(answer.status, 400, "{what}: {}", answer.text());
        assert!(answer.json()["error"].as_str().is_some_and(|text| text.contains("expected") || text.contains("113")));
    }
}
