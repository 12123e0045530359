//! What the fuzzer has found worth keeping, drawn again by both renderers.

#[path = "../../fuzz/case.rs"]
mod case;

#[test]
fn every_case_of_the_corpus_is_equal() {
    let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/corpus/triangles");
    let mut paths: Vec<_> =
        std::fs::read_dir(corpus).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 100, "{} cases in {corpus} prove little", paths.len());
    for path in paths {
        if let Err(error) = case::check(&std::fs::read(&path).unwrap()) {
            panic!("{}: {error}", path.display());
        }
    }
}
