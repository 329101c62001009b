// The names of the labels of an image, from the image's own file or from a file beside it.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace palpate {

// Returns the names by label; none where no source has names. The sources, of which the first with names wins:
//   1. NIfTI: a header extension that holds a label table (<Label Key="1"><![CDATA[spleen]]></Label>) or JSON as below;
//      NRRD: the fields Segment0_Name and Segment0_LabelValue, Segment1_Name ... of 3D Slicer.
//   2. Files in the image's folder: STEM.json, STEM.csv, STEM.tsv (STEM.nii.gz is the image), labels.json, labels.csv,
//      labels.tsv, dataset.json. JSON: {"1": "spleen"}, {"spleen": 1}, either of them under "labels", or objects with a
//      number ("labelID", "value", "label", "id") and a name ("name", "SegmentLabel"). CSV: lines with a whole number and
//      a word.
// A file beside the image that has another content is passed over. Errors: InputError where the image cannot be read.
std::map<float, std::string> read_label_names(const std::filesystem::path& image);

}  // namespace palpate
