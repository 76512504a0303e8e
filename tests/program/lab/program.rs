//! `misclosure lab` as a process, and a client that says exactly what it is told to.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A step of the blocks here takes a second; a busy machine may need many times that.
const PATIENCE: Duration = Duration::from_secs(240);

/// A block of the repository.
pub fn block(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/hidden").join(name)
}

/// The program with these arguments.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_misclosure"));
    command.arg("lab").args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A laboratory that answers.
pub struct Lab {
    child: Child,
    pub port: u16,
    pub token: String,
}

/// An answer.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }
}

impl Lab {
    pub fn open(block: &Path, folder: &Path) -> Self {
        Self::start(&[block.to_str().expect("UTF-8"), "-o", folder.to_str().expect("UTF-8")])
    }

    pub fn start(arguments: &[&str]) -> Self {
        let mut child = command(arguments).arg("--no-open").stderr(Stdio::null()).spawn().expect("the program");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("its address");
        let (address, token) = line.trim().split_once("/?token=").unwrap_or_else(|| panic!("no address: {line:?}"));
        let port = address.strip_prefix("http://127.0.0.1:").and_then(|port| port.parse().ok()).expect("a port");
        Self { child, port, token: token.into() }
    }

    /// Ends the program as `kill -9` does.
    pub fn kill(mut self) {
        self.child.kill().expect("a process");
        self.child.wait().expect("its end");
    }

    /// Sends these lines, and the body, as they are.
    pub fn raw(&self, first: &str, headers: &[(&str, &str)], body: &str) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("a server");
        let mut text = format!("{first} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(text.as_bytes()).expect("a request");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head");
        let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
        let mut body = bytes.split_off(end + 4);
        if head.contains("transfer-encoding: chunked") {
            body = unchunked(&body);
        }
        Answer { status, head, body }
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    pub fn get(&self, path: &str) -> Answer {
        let host = self.host();
        self.raw(&format!("GET /api/{path}"), &[("Host", &host), ("X-Token", &self.token)], "")
    }

    pub fn post(&self, path: &str, body: &Value) -> Answer {
        let host = self.host();
        let headers = [("Host", host.as_str()), ("X-Token", &self.token), ("Content-Type", "application/json")];
        self.raw(&format!("POST /api/{path}"), &headers, &body.to_string())
    }

    /// Asks for a step; gives its number.
    pub fn step(&self, parent: u64, change: Value) -> u64 {
        let answer = self.post("steps", &json!({ "parent": parent, "change": change }));
        assert_eq!(answer.status, 202, "{}", answer.text());
        answer.json()["id"].as_u64().expect("a number")
    }

    /// A node of the tree.
    pub fn node(&self, id: u64) -> Value {
        let tree = self.get("tree").json();
        let nodes = tree["nodes"].as_array().expect("nodes").clone();
        nodes.into_iter().find(|node| node["id"] == id).unwrap_or(Value::Null)
    }

    /// Waits until a node is in one of these states.
    pub fn wait(&self, id: u64, states: &[&str]) -> Value {
        let began = Instant::now();
        loop {
            let node = self.node(id);
            if states.iter().any(|state| node["state"] == *state) {
                return node;
            }
            assert!(began.elapsed() < PATIENCE, "step {id} is not {states:?}: {node}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until a node is done.
    pub fn done(&self, id: u64) -> Value {
        let node = self.wait(id, &["done", "failed", "cancelled"]);
        assert_eq!(node["state"], "done", "{node}");
        node
    }
}

impl Drop for Lab {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn unchunked(mut bytes: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    while let Some(end) = bytes.windows(2).position(|two| two == b"\r\n") {
        let size = usize::from_str_radix(&String::from_utf8_lossy(&bytes[..end]), 16).expect("a size");
        if size == 0 {
            break;
        }
        body.extend(&bytes[end + 2..end + 2 + size]);
        bytes = &bytes[end + 4 + size..];
    }
    body
}
