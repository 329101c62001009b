// The descriptors of the effects: what they say about palpate_scene_def, and that every host has their keys.
#include <regex>
#include <set>

#include "formats/config_keys.h"
#include "runtime/complete/effects.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

// Reads a file of the sources.
std::string source(const std::string& file) {
  return file_bytes(std::filesystem::path(PALPATE_SOURCE_FOLDER) / file);
}

template <class Each>
void for_every_key(Each each) {
  for (const Effect* effect : all_effects())
    for (const EffectKey& key : effect->keys) each(*effect, key);
}

// "relaxation" of "relaxation.terms": hosts give a struct in one.
std::string field_of(const EffectKey& key) {
  const std::string name = key.name;
  return name.substr(0, name.find('.'));
}

// Off, on of the words in a list of any language: "off", "on".
std::string words_in(const std::string& list) {
  std::string words;
  const std::regex word("\"([^\"]*)\"");
  for (std::sregex_iterator i(list.begin(), list.end(), word), end; i != end; ++i)
    words += (words.empty() ? "" : ", ") + (*i)[1].str();
  return words;
}

// The words that follow a place in a text, up to `close`; "" where the text does not have the place.
std::string words_behind(const std::string& text, const std::string& place, char close) {
  const std::size_t at = text.find(place);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + place.size();
  return words_in(text.substr(begin, text.find(close, begin) - begin));
}

TEST(Descriptors, HaveNamesAndFieldsOfTheirOwn) {
  std::set<std::string> names;
  std::vector<int> owners(sizeof(palpate_scene_def), 0);
  for (const Effect* effect : all_effects()) {
    EXPECT_TRUE(names.insert(effect->name).second) << effect->name;
    EXPECT_TRUE(effect->build || effect->prepare) << effect->name;
    EXPECT_FALSE(effect->keys.empty()) << effect->name;
  }
  for_every_key([&](const Effect&, const EffectKey& key) {
    ASSERT_LE(key.at + key.bytes, owners.size()) << key.name;
    for (std::size_t b = key.at; b < key.at + key.bytes; ++b) EXPECT_EQ(owners[b]++, 0) << key.name;
  });
}

TEST(Descriptors, AreOfEffectsThatAreOffByDefault) {
  const palpate_scene_def def = palpate_default_scene_def();
  for (const Effect* effect : all_effects()) EXPECT_FALSE(effect->is_on(def)) << effect->name;
}

// Every choice has as many words as values, and every reason is a sentence that names what to do.
TEST(Descriptors, SayWordsOfAllValuesAndReasons) {
  for_every_key([](const Effect&, const EffectKey& key) {
    const std::string words = key.words;
    if (key.type == EffectKey::Type::choice)
      EXPECT_EQ(std::count(words.begin(), words.end(), ','), key.most) << key.name;
    else
      EXPECT_EQ(words, "") << key.name;
  });
  for (const Effect* effect : all_effects())
    for (const EffectNeed& need : effect->needs) {
      EXPECT_GT(std::string(need.reason).size(), 20u) << effect->name;
      EXPECT_NE(need.values, 0u) << effect->name;
    }
}

// A value outside of its limits is refused by its name, and one that the effect excludes with the reason.
TEST(Descriptors, AreWhatASceneIsCheckedBy) {
  const TouchedBox box;
  const auto refusal = [&](const palpate_scene_def& def) {
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    EXPECT_NE(palpate_scene_create(box.bundle(), &def, &scene, &error), PALPATE_OK);
    palpate_scene_destroy(scene);
    return std::string(error.text);
  };
  const auto with = [](palpate_scene_def def, std::size_t at, int value) {
    std::memcpy(reinterpret_cast<unsigned char*>(&def) + at, &value, sizeof value);
    return def;
  };
  for (const Effect* effect : all_effects()) {
    const EffectKey& first = effect->keys[0];
    if (first.type == EffectKey::Type::pointer) continue;
    const palpate_scene_def off = palpate_default_scene_def();
    palpate_scene_def on = with(off, first.at, 1);
    for (const EffectKey& key : effect->keys.subspan(1))
      if (key.type != EffectKey::Type::numbers) on = with(on, key.at, key.least);
    EXPECT_THAT(refusal(with(off, first.at, first.most + 1)), testing::HasSubstr(first.name));
    EXPECT_THAT(refusal(with(off, first.at, -1)), testing::HasSubstr(first.name));
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

TEST(Descriptors, HaveAKeywordInPythonWithTheirWords) {
  const std::string bound = source("bindings/python/effects.h"), typed = source("bindings/python/palpate/__init__.pyi");
  for_every_key([&](const Effect&, const EffectKey& key) {
    const std::string field = field_of(key);
    EXPECT_THAT(bound, testing::HasSubstr("py::arg(\"" + field + "\")"));
    EXPECT_THAT(typed, testing::HasSubstr(field + ":"));
    const std::string words = words_behind(bound, "(\"" + field + "\", " + field + ", {", '}');
    if (words.empty()) return;
    EXPECT_EQ(words, key.words) << field;
  });
}

TEST(Descriptors, HaveAFieldInJavaScriptWithTheirWords) {
  const std::string names = source("bindings/web/module/scene_def.js"),
                    offsets = source("bindings/web/module/struct_fields.c");
  const std::string of_def = offsets.substr(offsets.find("STRUCT(palpate_scene_def,"));
  const std::string fields = of_def.substr(0, of_def.find(')'));
  for_every_key([&](const Effect&, const EffectKey& key) {
    EXPECT_TRUE(std::regex_search(fields, std::regex("[ ,]" + std::string(key.name) + "(,|$)"))) << key.name;
    const std::string words = words_behind(names, "\n  " + field_of(key) + ": [", ']');
    if (!words.empty())
      EXPECT_EQ(words, key.words) << key.name;
    else
      EXPECT_THAT(names, testing::ContainsRegex("[\".]" + field_of(key))) << key.name;
  });
}

// A scene file may leave a key to a tool or a link that needs it; where it has one, it has the words.
TEST(Descriptors, HaveTheWordsOfSceneFiles) {
  int found = 0;
  for_every_key([&](const Effect&, const EffectKey& key) {
    const ConfigKey* const in_file = find_config_key(ConfigFile::scene, "effects", key.name);
    if (!in_file || std::string(in_file->type) != "choice") return;
    EXPECT_STREQ(in_file->limits, key.words) << key.name;
    ++found;
  });
  EXPECT_GT(found, 0);
}

}  // namespace
}  // namespace palpate::tests
