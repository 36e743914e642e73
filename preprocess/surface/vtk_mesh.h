#pragma once
/// What VTK's readers and writers complain of, collected instead of printed; for the .cpp files
/// here that call them.
#include <vtkCellArray.h>
#include <vtkLogger.h>
#include <vtkOutputWindow.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <iostream>
#include <string>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// What VTK complains of in this thread while the object lives, collected instead of printed:
/// readers only print errors, and those of the parsers and compressors inside reach no observer.
class VtkErrors {
 public:
  VtkErrors() : outer_(current_) {
    static const bool installed = [] {
      vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
      vtkOutputWindow::SetInstance(vtkSmartPointer<Window>::Take(new Window));
      return true;
    }();
    expects(installed);
    current_ = this;
  }
  ~VtkErrors() { current_ = outer_; }
  VtkErrors(const VtkErrors&) = delete;
  VtkErrors& operator=(const VtkErrors&) = delete;

  bool any() const { return any_; }
  /// The first error's own words, without VTK's source path and object address.
  const std::string& text() const { return text_; }

 private:
  /// Stands in for VTK's output of the whole process; other threads' messages are printed as ever.
  class Window : public vtkOutputWindow {
   public:
    vtkTypeMacro(Window, vtkOutputWindow) void DisplayText(const char* text) override {
      if (!current_) std::cerr << text;
    }
    void DisplayErrorText(const char* text) override {
      current_ ? current_->add(text) : DisplayText(text);
    }
  };

  void add(std::string text) {
    if (any_) return;
    any_ = true;
    if (const auto start = text.find("): "); start != std::string::npos) text.erase(0, start + 3);
    text_ = text.substr(0, text.find_last_not_of(" \r\n") + 1);
  }

  inline static thread_local VtkErrors* current_ = nullptr;
  VtkErrors* outer_;
  bool any_ = false;
  std::string text_;
};

/// Points and triangles; the polygons must be triangles.
inline Surface surface_from(vtkPolyData* data) {
  Surface surface;
  surface.vertices.resize(3, data->GetNumberOfPoints());
  for (vtkIdType k = 0; k < data->GetNumberOfPoints(); ++k) {
    data->GetPoint(k, surface.vertices.col(k).data());
  }
  surface.triangles.resize(3, data->GetNumberOfPolys());
  vtkIdType column = 0, corners = 0;
  const vtkIdType* ids = nullptr;
  for (data->GetPolys()->InitTraversal(); data->GetPolys()->GetNextCell(corners, ids); ++column) {
    expects(corners == 3);
    for (int k = 0; k < 3; ++k) surface.triangles(k, column) = static_cast<int>(ids[k]);
  }
  return surface;
}

}  // namespace wireplan::preprocess
