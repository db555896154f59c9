!! A branch of periodic motions over a parameter: its motions, and the special points between them, one label a place.
module razy_orbits_branch_branch
   use razy_orbits_branch_place, only: are_one, place_of
   use razy_orbits_branch_point, only: point_t
   implicit none(type, external)
   private

   public :: branch_t

   type :: branch_t
      !> Points 1 to `count` along the branch; periods of the excitation in one of the motion.
      type(point_t), allocatable :: point(:)
      integer :: count = 0, periods = 1
      !> The branch that it begins on, 0: it was found by itself.
      integer :: parent = 0
      !> Whether it begins where its parent ends as a stop is touched.
      logical :: from_touch = .false.
      !> Why it ends, in words; whether it has come back to its first motion.
      character(:), allocatable :: ending
      logical :: closed = .false.
      !> Steps in which other multipliers come across the unit circle, or contacts change, than special points say.
      integer :: unexplained = 0
   contains
      procedure :: add
   end type branch_t

contains

   !> The next point; at the place of the last special one the two become one.
   subroutine add(self, point)
      class(branch_t), intent(inout) :: self
      type(point_t), intent(in) :: point

      type(point_t), allocatable :: more(:)

      if (.not. allocated(self%point)) allocate (self%point(64))
      if (self%count > 0) then
         if (are_one(self%point(self%count), point)) then
            self%point(self%count) = place_of(self%point(self%count), point)
            return
         end if
      end if
      if (self%count == size(self%point)) then
         allocate (more(2*self%count))
         more(:self%count) = self%point
         call move_alloc(more, self%point)
      end if
      self%count = self%count + 1
      self%point(self%count) = point
   end subroutine add

end module razy_orbits_branch_branch
