!! The kinds of scene by name.
module razy_scenes_factory
   use razy_core_text, only: lower
   use razy_scenes_common_schema, only: scene_kinds
   use razy_scenes_lumped, only: lumped_t
   use razy_scenes_scene, only: scene_t
   implicit none(type, external)
   private

   public :: new_scene, scene_kinds

contains

   !> A scene of the kind; not allocated if there is no such kind.
   subroutine new_scene(scene, kind)
      class(scene_t), allocatable, intent(out) :: scene
      character(*), intent(in) :: kind

      select case (lower(kind))
      case ("lumped")
         allocate (lumped_t :: scene)
      end select
   end subroutine new_scene

end module razy_scenes_factory
