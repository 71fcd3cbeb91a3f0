//! The checked-in descriptor set and Rust code are what `proto/armcal.proto` compiles to, so that building
//! armcal needs neither protoc nor a code generator. After a change of the .proto:
//! `ARMCAL_UPDATE_PROTO=1 cargo test -p armcal-report --test report proto`.

use prost_reflect::prost::Message as _;
use std::path::{Path, PathBuf};

fn proto_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("proto")
}

/// Descriptor set without source positions, and Rust code with the comments of the .proto.
fn compile() -> (Vec<u8>, String) {
    let fds = protox::compile(["armcal.proto"], [proto_folder()]).expect("armcal.proto compiles");
    let code_folder = tempfile::tempdir().expect("temporary folder");
    prost_build::Config::new()
        .out_dir(code_folder.path())
        .format(true)
        .compile_fds(fds.clone())
        .expect("code is generated");
    let code = std::fs::read_to_string(code_folder.path().join("armcal.rs")).expect("generated file");
    let mut bare = fds;
    for file in &mut bare.file {
        file.source_code_info = None;
    }
    (bare.encode_to_vec(), code)
}

#[test]
fn descriptor_set_and_code_match_the_proto_file() {
    let (descriptors, code) = compile();
    let (descriptors_path, code_path) =
        (proto_folder().join("armcal.binpb"), proto_folder().join("armcal.rs"));
    if std::env::var_os("ARMCAL_UPDATE_PROTO").is_some() {
        std::fs::write(&descriptors_path, &descriptors).expect("write descriptor set");
        std::fs::write(&code_path, &code).expect("write code");
    }
    let stale = "is stale: run this test with ARMCAL_UPDATE_PROTO=1";
    assert!(std::fs::read(&descriptors_path).expect("armcal.binpb") == descriptors, "armcal.binpb {stale}");
    assert!(std::fs::read_to_string(&code_path).expect("armcal.rs") == code, "armcal.rs {stale}");
}
