"""The frame of a benchmark is ranked and agrees with its document."""


def test_the_benchmark_frame_is_ranked_and_agrees_with_its_document(compared):
    frame = compared.to_frame()
    assert list(frame["model"]) == compared.ranking == ["constant", "textbook"]
    assert frame["error"].is_monotonic_increasing
    document = compared.document()["models"]
    assert frame["error"][0] == document["constant"]["error"]
    assert (frame["error_ci95_low"] <= frame["error"]).all()
    by_recording = compared.by_recording().set_index("recording")
    assert by_recording.loc["run1", "textbook"] == document["textbook"]["by_recording"]["run1"]
