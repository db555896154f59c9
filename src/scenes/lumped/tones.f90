!! Mean speeds of a lumped scene, from which the tooth frequencies of its gear meshes follow.
!!
!! Bodies joined by springs, dampers or stops have the same mean speed; a mesh changes it in the ratio of the teeth.
module razy_scenes_lumped_tones
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: qp
   use razy_scenes_lumped_bodies, only: bodies_t, find_body, find_ends
   implicit none(type, external)
   private

   public :: find_speeds

contains

   !> Mean speeds of all bodies, turns a second, in multiples of that of `&rotation`; 0 where nothing says what it is.
   subroutine find_speeds(input, bodies, ratio, error)
      type(input_t), intent(in) :: input
      type(bodies_t), intent(in) :: bodies
      real(qp), intent(out) :: ratio(:)
      type(error_t), allocatable, intent(out) :: error

      character(6), parameter :: joining(3) = ["spring", "damper", "stop  "]
      integer :: body, i, k, pass

      ratio = 0.0_qp
      if (input%count("rotation") == 0) return
      call find_body(bodies, input, "rotation", 1, "of", 1, body, error)
      if (allocated(error)) return
      if (.not. bodies%turns(body)) then
         call input%complain(error, "rotation", 1, "of", "the name of an inertia")
         return
      end if
      ratio(body) = 1.0_qp
      do pass = 1, bodies%count
         do k = 1, size(joining)
            do i = 1, input%count(trim(joining(k)))
               call join(trim(joining(k)), i, 1.0_qp)
               if (allocated(error)) return
            end do
         end do
         do i = 1, input%count("gear_mesh")
            call join("gear_mesh", i, tooth_ratio(input, i))
            if (allocated(error)) return
         end do
      end do

   contains

      !> The second body turns `change` times as fast as the first.
      subroutine join(group, index, change)
         character(*), intent(in) :: group
         integer, intent(in) :: index
         real(qp), intent(in) :: change

         integer :: ends(2)

         call find_ends(bodies, input, group, index, ends, error)
         if (allocated(error) .or. any(ends == 0)) return
         if (abs(ratio(ends(1))) > 0.0_qp .and. .not. abs(ratio(ends(2))) > 0.0_qp) then
            ratio(ends(2)) = change*ratio(ends(1))
         else if (abs(ratio(ends(2))) > 0.0_qp .and. .not. abs(ratio(ends(1))) > 0.0_qp) then
            ratio(ends(1)) = ratio(ends(2))/change
         else if (abs(ratio(ends(2)) - change*ratio(ends(1))) > 1.0e-20_qp*abs(ratio(ends(2)))) then
            call input%complain(error, group, index, "between", "bodies whose mean speeds agree with the rest of the machine")
         end if
      end subroutine join

   end subroutine find_speeds

   !> Speed of the second wheel of a mesh in multiples of that of the first.
   function tooth_ratio(input, mesh) result(ratio)
      type(input_t), intent(in) :: input
      integer, intent(in) :: mesh
      real(qp) :: ratio

      integer, allocatable :: teeth(:)

      call input%get("gear_mesh", mesh, "teeth", teeth)
      ratio = real(teeth(1), qp)/teeth(2)
   end function tooth_ratio

end module razy_scenes_lumped_tones
