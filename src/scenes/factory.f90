!! The kinds of scene by name.
module razy_scenes_factory
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_text, only: lower
   use razy_scenes_parts_scene, only: parts_t
   use razy_scenes_rotor_scene, only: rotor_scene_t
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: draw_scene, new_scene

contains

   !> A scene of the kind; not allocated if there is no such kind.
   subroutine new_scene(scene, kind)
      class(scene_t), allocatable, intent(out) :: scene
      character(*), intent(in) :: kind

      select case (lower(kind))
      case ("lumped", "planar")
         allocate (parts_t :: scene)
      case ("rotor")
         allocate (rotor_scene_t :: scene)
      case default
         return
      end select
   end subroutine new_scene

   !> The geometry of the machine that a scene has built; not allocated for one that has none.
   subroutine draw_scene(scene, drawing, input, error)
      class(scene_t), intent(in) :: scene
      type(drawing_t), allocatable, intent(out) :: drawing
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      select type (scene)
      class is (parts_t)
         if (input%count("body") == 0) return
         allocate (drawing)
         call scene%draw(drawing, input, error)
      end select
   end subroutine draw_scene

end module razy_scenes_factory
