// The keys of palpate_scene_def and the descriptors of the effects: what they say, and what hosts print from them.
#include <fmt/ranges.h>

#include <fstream>
#include <set>
#include <sstream>

#include "runtime/complete/effects.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

// Reads a file of the sources.
std::string source(const std::string& file) {
  return file_bytes(std::filesystem::path(PALPATE_SOURCE_FOLDER) / file);
}

template <class Each>
void for_each_key(Each each) {
  for (std::int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k) each(*key);
}

std::size_t offset_of(const palpate_key& key) {
  return static_cast<std::size_t>(key.offset);
}

std::vector<std::string> words_of(const palpate_key& key) {
  std::vector<std::string> words;
  std::istringstream list(key.words);
  for (std::string word; std::getline(list >> std::ws, word, ',');) words.push_back('"' + word + '"');
  return words;
}

TEST(Descriptors, HaveNamesAndFieldsOfTheirOwn) {
  std::set<std::string> names;
  std::vector<int> owners(sizeof(palpate_scene_def), 0);
  for (const Effect* effect : all_effects()) {
    EXPECT_TRUE(names.insert(effect->name).second) << effect->name;
    EXPECT_TRUE(effect->build || effect->prepare) << effect->name;
    EXPECT_FALSE(effect->keys.empty()) << effect->name;
  }
  std::size_t keys = core_keys().size();
  for (const Effect* effect : all_effects()) keys += effect->keys.size();
  for_each_key([&](const palpate_key& key) {
    const auto begin = static_cast<std::size_t>(key.offset), end = begin + static_cast<std::size_t>(key.bytes);
    ASSERT_LE(end, owners.size()) << key.name;
    for (std::size_t b = begin; b < end; ++b) EXPECT_EQ(owners[b]++, 0) << key.name;
    --keys;
  });
  EXPECT_EQ(keys, 0u);
  EXPECT_EQ(palpate_scene_key(-1), nullptr);
  // The 4 bytes in front of an 8-byte field may be padding. Of a field without a key a saved state would not know.
  for_each_key([&](const palpate_key& key) {
    const auto field = owners.begin() + key.offset;
    if (key.bytes % 8 == 0) std::fill(field - 4, field, 1);
  });
  EXPECT_EQ(std::count(owners.begin() + sizeof(std::uint32_t), owners.end(), 0), 0);
}

TEST(Descriptors, AreOfEffectsThatAreOffByDefault) {
  const palpate_scene_def def = palpate_default_scene_def();
  for (const Effect* effect : all_effects()) EXPECT_FALSE(effect->is_on(def)) << effect->name;
}

// Every choice has as many words as values, and every reason is a sentence that names what to do.
TEST(Descriptors, SayWordsOfAllValuesAndReasons) {
  for_each_key([](const palpate_key& key) {
    if (key.type != PALPATE_KEY_CHOICE) return;
    EXPECT_EQ(words_of(key).size(), key.most + 1) << key.name;
  });
  for (const Effect* effect : all_effects())
    for (const EffectNeed& need : effect->needs) {
      EXPECT_GT(std::string(need.reason).size(), 20u) << effect->name;
      EXPECT_NE(need.values, 0u) << effect->name;
    }
}

std::string refusal_of(const TouchedBox& box, const palpate_scene_def& def) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  EXPECT_NE(palpate_scene_create(box.bundle(), &def, &scene, &error), PALPATE_OK);
  palpate_scene_destroy(scene);
  return error.text;
}

// Every field of the core is refused by its name outside of its limits.
TEST(Descriptors, SayTheLimitsOfTheCore) {
  const TouchedBox box;
  for (const EffectKey& key : core_keys()) {
    if (key.type == PALPATE_KEY_POINTER) continue;
    for (const double value : {key.least - 1, key.most + 1, static_cast<double>(NAN)}) {
      if (value > 1e300) continue;
      palpate_scene_def def = palpate_default_scene_def();
      palpate_set_key(&key, &def, value);
      EXPECT_THAT(refusal_of(box, def), testing::HasSubstr(std::string("palpate_scene_def: ") + key.name));
    }
  }
}

// A host whose header is older has a smaller struct.
TEST(Descriptors, DoNotReachBeyondTheHostsStruct) {
  palpate_scene_def def = palpate_default_scene_def();
  for_each_key([&](const palpate_key& key) {
    def.struct_bytes = static_cast<std::uint32_t>(key.offset);
    const palpate_scene_def before = def;
    EXPECT_EQ(palpate_set_key(&key, &def, 1), 0) << key.name;
    EXPECT_EQ(palpate_key_number(&key, &def), 0) << key.name;
    EXPECT_EQ(std::memcmp(&before, &def, sizeof def), 0) << key.name;
  });
}

// A value outside of its limits is refused by its name, and one that the effect excludes with the reason.
TEST(Descriptors, AreWhatASceneIsCheckedBy) {
  const TouchedBox box;
  const auto refusal = [&](const palpate_scene_def& def) { return refusal_of(box, def); };
  const auto with = [](palpate_scene_def def, std::size_t at, int value) {
    std::memcpy(reinterpret_cast<unsigned char*>(&def) + at, &value, sizeof value);
    return def;
  };
  for (const Effect* effect : all_effects()) {
    const EffectKey& first = effect->keys[0];
    if (first.type == PALPATE_KEY_POINTER) continue;
    const palpate_scene_def off = palpate_default_scene_def();
    palpate_scene_def on = with(off, offset_of(first), 1);
    for (const EffectKey& key : effect->keys.subspan(1))
      if (key.type != PALPATE_KEY_NUMBER) on = with(on, offset_of(key), static_cast<int>(key.least));
    EXPECT_THAT(refusal(with(off, offset_of(first), static_cast<int>(first.most) + 1)), testing::HasSubstr(first.name));
    EXPECT_THAT(refusal(with(off, offset_of(first), -1)), testing::HasSubstr(first.name));
    for (const EffectNeed& need : effect->needs) {
      // All needs are met but this one.
      palpate_scene_def def = on;
      for (const EffectNeed& other : effect->needs)
        for (int value = 0; !other.is_met(def); ++value) def = with(def, other.at, value);
      int missing = 0;
      while (missing < 32 && (need.values >> missing & 1u) != 0) ++missing;
      // One that the library does not know at all is refused before.
      EXPECT_THAT(refusal(with(def, need.at, missing)),
                  testing::AnyOf(testing::HasSubstr(need.reason), testing::HasSubstr("is OFF")))
          << effect->name;
    }
  }
}

// ---- what hosts print from the keys ----------------------------------------------------------------------------------

// The types of a choice, a switch (off, on), a flag, a count and a number in a language.
struct Types {
  const char *choice, *switched, *flag, *count, *number, *between_words;
};
std::string type_of(const palpate_key& key, const Types& types) {
  if (key.type != PALPATE_KEY_CHOICE)
    return key.type == PALPATE_KEY_FLAG ? types.flag : key.type == PALPATE_KEY_COUNT ? types.count : types.number;
  const std::string words = fmt::format("{}", fmt::join(words_of(key), types.between_words));
  return fmt::format(fmt::runtime(std::string_view(key.words) == "off, on" ? types.switched : types.choice), words);
}

bool is_keyword(const palpate_key& key) {
  return key.type != PALPATE_KEY_POINTER && !std::strchr(key.name, '.');
}

std::string python_lines() {
  constexpr Types types = {"Literal[{}]", "Union[bool, Literal[{}]]", "bool", "int", "float", ", "};
  std::string lines;
  for_each_key([&](const palpate_key& key) {
    if (is_keyword(key)) lines += fmt::format("    {}: {}\n", key.name, type_of(key, types));
  });
  return lines;
}

std::string javascript_lines() {
  constexpr Types types = {"{}", "boolean | {}", "boolean", "number", "number", " | "};
  std::string lines = "/** @typedef {{", line;
  for_each_key([&](const palpate_key& key) {
    if (!is_keyword(key)) return;
    std::string name = key.name;
    for (std::size_t at; (at = name.find('_')) != std::string::npos;)
      name.erase(at, 1), name[at] = static_cast<char>(std::toupper(name[at]));
    const std::string field = fmt::format(" {}?: {},", name, type_of(key, types));
    if (line.empty() || line.size() + field.size() > 140) lines += std::exchange(line, "\n *  ");
    line += field;
  });
  return lines + line + "\n * }} SceneKeys */\n";
}

// The file has these lines between its two marks.
void expect_printed(const std::string& file, const std::string& lines) {
  const std::string text = source(file), mark = "Printed from palpate_scene_key():\n";
  const std::size_t begin = text.find(mark), end = text.find("(end of what is printed)");
  ASSERT_TRUE(begin < end && end != std::string::npos) << file;
  const std::string expected = text.substr(0, begin + mark.size()) + lines + text.substr(text.rfind('\n', end) + 1);
  if (text == expected) return;
  const std::filesystem::path printed = fresh_folder() / std::filesystem::path(file).filename();
  std::ofstream(printed) << expected;
  ADD_FAILURE() << file << " does not say what palpate_scene_key() says; replace it: cp " << printed.string() << ' '
                << file;
}

TEST(Descriptors, ArePrintedWhereHostsNeedThemAsText) {
  expect_printed("bindings/python/palpate/__init__.pyi", python_lines());
  expect_printed("bindings/web/module/palpate.js", javascript_lines());
}

}  // namespace
}  // namespace palpate::tests
