#include "server/capture/camera_files/opencv_xml.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/str_split.h>
#include <expat.h>

#include <memory>
#include <vector>

namespace saccade {
namespace {

constexpr std::size_t kMostDepth = 8;  // a matrix is two deep

/// Writes flow YAML while expat reads: `{"name":{"rows":"3",...},}`.
struct Writer {
  struct Element {
    std::string text;
    bool has_children = false;
  };
  XML_Parser parser = nullptr;
  std::string yaml;
  std::size_t lines = 1;  // written, that the last one counts
  std::vector<Element> open;
  std::string error;

  std::size_t line() const { return XML_GetCurrentLineNumber(parser); }
  void Refuse(absl::string_view why) {
    if (error.empty()) error = absl::StrCat(":", line(), ": ", why);
    XML_StopParser(parser, XML_FALSE);
  }
  void CatchUp() {
    for (; lines < line(); ++lines) yaml += '\n';
  }
  static std::string Quoted(absl::string_view text) {
    return absl::StrCat(
        "\"", absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"\"", "\\\""}, {"\n", " "}}), "\"");
  }

  void Begin(absl::string_view name) {
    if (open.empty() && name != "opencv_storage") {
      Refuse(absl::StrCat("<", name,
                          ">: is XML, but not OpenCV's <opencv_storage>; write camera.yaml, or "
                          "save the calibration with cv::FileStorage"));
    }
    if (open.size() >= kMostDepth) Refuse("is nested too deep for a camera file");
    if (!error.empty()) return;
    if (!open.empty()) {
      if (!open.back().has_children) yaml += '{';
      open.back().has_children = true;
      CatchUp();
      absl::StrAppend(&yaml, Quoted(name), ": ");
    }
    open.emplace_back();
  }
  void End(absl::string_view name) {
    const Element element = std::move(open.back());
    open.pop_back();
    if (element.has_children) {
      yaml += '}';
    } else if (open.empty()) {
      yaml += "{}";
    } else if (name == "data") {
      WriteNumbers(element.text);
    } else {
      yaml += Quoted(absl::StripAsciiWhitespace(element.text));
    }
    if (!open.empty()) yaml += ", ";
  }
  /// Each on the line that it was on.
  void WriteNumbers(absl::string_view text) {
    yaml += '[';
    bool first = true;
    for (const absl::string_view row : absl::StrSplit(text, '\n')) {
      if (!first) ++lines, yaml += '\n';
      first = false;
      for (const absl::string_view word :
           absl::StrSplit(row, absl::ByAnyChar(" \t\r"), absl::SkipEmpty())) {
        absl::StrAppend(&yaml, Quoted(word), ", ");
      }
    }
    yaml += ']';
  }
};

void XMLCALL OnBegin(void* user, const XML_Char* name, const XML_Char**) {
  static_cast<Writer*>(user)->Begin(name);
}
void XMLCALL OnEnd(void* user, const XML_Char* name) { static_cast<Writer*>(user)->End(name); }
void XMLCALL OnText(void* user, const XML_Char* text, int length) {
  auto* writer = static_cast<Writer*>(user);
  if (!writer->open.empty()) {
    writer->open.back().text.append(text, static_cast<std::size_t>(length));
  }
}
/// No entities but XML's own: nothing that a calibration needs, and a way to blow up a small file.
void XMLCALL OnEntity(void* user, const XML_Char*, int, const XML_Char*, int, const XML_Char*,
                      const XML_Char*, const XML_Char*, const XML_Char*) {
  static_cast<Writer*>(user)->Refuse("declares entities, which no camera file needs");
}

}  // namespace

absl::StatusOr<std::string> YamlOfOpenCvXml(absl::string_view xml) {
  Writer writer;
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       &XML_ParserFree);
  if (parser == nullptr) return absl::ResourceExhaustedError(": no memory to read the XML");
  writer.parser = parser.get();
  XML_SetUserData(writer.parser, &writer);
  XML_SetElementHandler(writer.parser, OnBegin, OnEnd);
  XML_SetCharacterDataHandler(writer.parser, OnText);
  XML_SetEntityDeclHandler(writer.parser, OnEntity);
  const XML_Status status =
      XML_Parse(writer.parser, xml.data(), static_cast<int>(xml.size()), XML_TRUE);
  if (!writer.error.empty()) return absl::InvalidArgumentError(writer.error);
  if (status != XML_STATUS_OK) {
    return absl::InvalidArgumentError(absl::StrCat(":", writer.line(), ": not valid XML (",
                                                   XML_ErrorString(XML_GetErrorCode(writer.parser)),
                                                   ")"));
  }
  return writer.yaml;
}

}  // namespace saccade
