// Where OpenGL draws: off screen (EGL, no display server needed) or in a window (GLFW).
//
//   OffscreenContext context(1280, 480);        // throws GlError: one line that names the fix
//   SceneRenderer scene;                        // GL objects live shorter than their context
//   ...
//   context.present();
//   Image picture = context.read_rgb();
//
// OpenGL 3.3 core or newer. A context belongs to the thread that made it. Every GL object must be
// destroyed before its context.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/image.h"

namespace foresight {

/// No context, no shader, no framebuffer: a start-up error whose text is one line with the fix.
class GlError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class GlContext {
 public:
  virtual ~GlContext() = default;
  virtual void make_current() = 0;
  /// The framebuffer that is shown: 0 for a window.
  virtual unsigned framebuffer() const = 0;
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  /// Shows what was drawn and takes in window events.
  virtual void present() = 0;
  /// The user asked to close the window.
  virtual bool should_close() const { return false; }
  /// Keys pressed since the last call, upper-case ASCII or GLFW key codes, in order.
  virtual std::vector<int> take_keys() { return {}; }

  /// Binds framebuffer() with a viewport over all of it.
  void bind();
  /// What the framebuffer shows, as RGB from the top row down. Call before present() in a window.
  Image read_rgb();
  Image read_rgb(int width, int height);  // the top-left part
};

/// Draws into memory. Works without X, Wayland or a GPU (Mesa's llvmpipe).
class OffscreenContext final : public GlContext {
 public:
  OffscreenContext(int width_px, int height_px);
  ~OffscreenContext() override;
  void make_current() override;
  unsigned framebuffer() const override;
  int width_px() const override;
  int height_px() const override;
  void present() override;

 private:
  struct Egl;
  std::unique_ptr<Egl> egl_;
};

struct WindowOptions {
  int width_px = 1280;
  int height_px = 480;
  std::string title = "Foresight";
  bool visible = true;
  bool wait_for_display = false;  // present() waits for the display's refresh
};

/// Draws in a window that the user can resize and close.
class WindowContext final : public GlContext {
 public:
  explicit WindowContext(const WindowOptions& options);
  ~WindowContext() override;
  void make_current() override;
  unsigned framebuffer() const override { return 0; }
  int width_px() const override;
  int height_px() const override;
  void present() override;
  bool should_close() const override;
  std::vector<int> take_keys() override;

 private:
  struct Glfw;
  std::unique_ptr<Glfw> glfw_;
};

}  // namespace foresight
