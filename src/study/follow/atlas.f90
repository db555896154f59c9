!! Branches over the whole range, put together on rank 0 from those of the cells (razy_study_follow_cells): two pieces are one
!! where both have the same motion at their ends.
module razy_study_follow_atlas
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_branch_point, only: point_t
   use razy_orbits_search, only: found_t, is_on, new_found
   use razy_study_follow_cells, only: arrival_t, cells_t, unpack_cell
   use razy_study_follow_follow, only: sample_t
   implicit none(type, external)
   private

   public :: atlas_t

   !> An end of a piece, the first (1) or the last (2) of its points, that may go on: its motion, the piece and end that it goes on
   !> with; whether it was handed to the next cell.
   type :: end_t
      logical :: open = .false., handed_on = .false.
      type(found_t) :: motion
      integer :: mate(2) = 0
   end type end_t

   !> A branch within a cell; the piece that it begins on, 0: none.
   type :: piece_t
      type(branch_t) :: branch
      integer :: cell = 0, parent = 0
      type(end_t) :: end(2)
   end type piece_t

   type :: atlas_t
      private
      type(piece_t), allocatable :: piece(:)
      integer :: count = 0
      type(sample_t), allocatable :: sample(:)
      logical :: begun = .false.
      !> Scales of the states here; the cells change those of the problem.
      real(wp) :: displacement = 1.0_wp, velocity = 1.0_wp
   contains
      procedure :: take
      procedure :: arrivals
      procedure :: finish
      procedure, private :: begin
      procedure, private :: add
      procedure, private :: mate_ends
   end type atlas_t

   !> Parameters nearer than this, in units of the range, are one.
   real(wp), parameter :: same_value = 1.0e-9_wp

contains

   !> Take over the row of a cell.
   subroutine take(self, cells, cell, row)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells
      integer, intent(in) :: cell
      type(table_t), intent(in) :: row

      type(branch_t), allocatable :: branch(:)
      type(sample_t) :: sample
      integer, allocatable :: place(:)
      integer :: i, known, old

      if (.not. allocated(self%sample)) allocate (self%sample(cells%cells), self%piece(64))
      associate (problem => cells%follow%problem)
         if (.not. self%begun) call self%begin(cells, row)
         call use_scales(self, cells)
         problem%periods = 1
         call unpack_cell(row, problem%scales(), branch, sample)
         allocate (place(size(branch)), source=0)
         old = self%count
         do i = 1, size(branch)
            known = duplicate(self, cells, cell, branch(i), old)
            if (known == 0) then
               call self%add(cells, cell, branch(i))
               known = self%count
               if (branch(i)%parent > 0) self%piece(known)%parent = place(branch(i)%parent)
               self%piece(known)%end(1)%open = branch(i)%parent == 0
            end if
            place(i) = known
         end do
      end associate
      if (allocated(self%sample(cell)%branch)) return
      sample%branch = place(sample%branch)
      self%sample(cell) = sample
   end subroutine take

   !> The first motion gives the scales.
   subroutine begin(self, cells, row)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells
      type(table_t), intent(in) :: row

      type(branch_t), allocatable :: branch(:)
      type(error_t), allocatable :: error
      type(sample_t) :: ignored

      associate (problem => cells%follow%problem)
         call unpack_cell(row, spread(1.0_wp, 1, problem%map%n + 1), branch, ignored)
         self%begun = size(branch) > 0
         if (.not. self%begun) return
         ! The scales have to do with the period there.
         associate (u => branch(1)%point(1)%orbit%u)
            problem%parameter(1) = u(size(u))
         end associate
         call problem%map%go_to(problem%parameter, error)
         call problem%begin(branch(1)%point(1)%orbit%u(:problem%map%n), 0.0_wp, abs(cells%border(cells%cells) - cells%border(0)))
         self%displacement = problem%displacement
         self%velocity = problem%velocity
      end associate
   end subroutine begin

   subroutine use_scales(self, cells)
      class(atlas_t), intent(in) :: self
      type(cells_t), intent(inout) :: cells

      cells%follow%problem%displacement = self%displacement
      cells%follow%problem%velocity = self%velocity
   end subroutine use_scales

   !> The piece, one of the first `last`, that this branch of the same cell was found to be before; 0: none.
   integer function duplicate(self, cells, cell, branch, last) result(place)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells
      integer, intent(in) :: cell, last
      type(branch_t), intent(in) :: branch

      type(found_t) :: middle

      if (any(self%piece(:last)%cell == cell)) call motion_at(cells, branch, (branch%count + 1)/2, middle)
      do place = 1, last
         if (self%piece(place)%cell /= cell) cycle
         if (is_on(middle, cells%follow%problem, self%piece(place)%branch)) return
      end do
      place = 0
   end function duplicate

   !> The motion at point i of a branch.
   subroutine motion_at(cells, branch, i, motion)
      type(cells_t), intent(inout) :: cells
      type(branch_t), intent(in) :: branch
      integer, intent(in) :: i
      type(found_t), intent(out) :: motion

      associate (problem => cells%follow%problem)
         problem%periods = branch%periods
         call new_found(motion, problem, branch%point(i)%orbit)
      end associate
   end subroutine motion_at

   subroutine add(self, cells, cell, branch)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells
      integer, intent(in) :: cell
      type(branch_t), intent(in) :: branch

      type(piece_t), allocatable :: more(:)
      integer :: side

      if (self%count == size(self%piece)) then
         allocate (more(2*self%count))
         more(:self%count) = self%piece
         call move_alloc(more, self%piece)
      end if
      self%count = self%count + 1
      associate (piece => self%piece(self%count))
         piece = piece_t(branch=branch, cell=cell)
         do side = 1, 2
            call motion_at(cells, branch, merge(1, branch%count, side == 1), piece%end(side)%motion)
         end do
         associate (p => cells%follow%problem%value_of(piece%end(2)%motion%orbit))
            piece%end(2)%open = branch%point(branch%count)%label == "EP" .and. &
                                (is_there(p, cells%border(cell - 1)) .or. is_there(p, cells%border(cell)))
         end associate
      end associate

   contains

      logical function is_there(p, border)
         real(wp), intent(in) :: p, border

         is_there = abs(p - border) <= same_value*cells%follow%problem%range
      end function is_there

   end subroutine add

   !> Find which ends are one motion.
   subroutine mate_ends(self)
      class(atlas_t), intent(inout) :: self

      integer :: i, k, one, other

      do i = 1, self%count
         do one = 1, 2
            do k = i + 1, self%count
               do other = 1, 2
                  associate (a => self%piece(i)%end(one), b => self%piece(k)%end(other))
                     if (.not. (a%open .and. b%open) .or. a%mate(1) + b%mate(1) > 0) cycle
                     if (.not. a%motion%is_same_as(b%motion, same_value)) cycle
                     a%mate = [k, other]
                     b%mate = [i, one]
                  end associate
               end do
            end do
         end do
      end do
   end subroutine mate_ends

   !> What has come to a border since this was asked last, and goes on in the next cell.
   subroutine arrivals(self, cells, arrival)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells
      type(arrival_t), allocatable, intent(out) :: arrival(:)

      real(wp), allocatable :: s(:)
      integer :: i, next

      call self%mate_ends()
      call use_scales(self, cells)
      cells%follow%problem%periods = 1
      s = cells%follow%problem%scales()
      allocate (arrival(0))
      do i = 1, self%count
         associate (piece => self%piece(i), end => self%piece(i)%end(2), n => size(s) - 1)
            if (.not. end%open .or. end%mate(1) > 0 .or. end%handed_on) cycle
            end%handed_on = .true.
            associate (p => cells%follow%problem%value_of(end%motion%orbit), &
                       middle => 0.5_wp*(cells%border(piece%cell - 1) + cells%border(piece%cell)))
               next = piece%cell + merge(1, -1, (p - middle)*(cells%border(cells%cells) - cells%border(0)) > 0.0_wp)
               if (next < 1 .or. next > cells%cells) cycle
               arrival = [arrival, arrival_t(next, piece%branch%periods, next - piece%cell, p, end%motion%phase(:, 1)*s(:n))]
            end associate
         end associate
      end do
   end subroutine arrivals

   !> The branches over the whole range, and what was seen at each sample.
   subroutine finish(self, cells)
      class(atlas_t), intent(inout) :: self
      type(cells_t), intent(inout) :: cells

      integer :: chain_of(self%count), i, pass

      call use_scales(self, cells)
      associate (follow => cells%follow)
         call follow%reset()
         follow%first(1) = cells%border(0)
         follow%last(1) = cells%border(cells%cells)
         if (allocated(follow%branch)) deallocate (follow%branch)
         allocate (follow%branch(self%count))
         chain_of = 0
         ! First those that begin on another, then those with an end, then closed ones.
         do pass = 1, 3
            do i = 1, self%count
               if (chain_of(i) > 0 .or. (pass == 1 .and. self%piece(i)%parent == 0)) cycle
               if (pass < 3 .and. all(self%piece(i)%end%mate(1) > 0)) cycle
               follow%count = follow%count + 1
               call chain(self, i, chain_of, follow%count, follow%values/follow%problem%range, follow%branch(follow%count))
            end do
         end do
         do i = 1, self%count
            associate (branch => follow%branch(chain_of(i)))
               if (self%piece(i)%parent > 0) branch%parent = chain_of(self%piece(i)%parent)
            end associate
         end do
         do i = 1, follow%count
            if (follow%branch(i)%ending == "") follow%branch(i)%ending = "where it was found"
         end do
         follow%sample = self%sample
         do i = 1, size(follow%sample)
            follow%sample(i)%branch = chain_of(follow%sample(i)%branch)
         end do
      end associate
   end subroutine finish

   !> The branch that piece `first` is a part of, from an end of it on; `values` of the user, in units of the range.
   subroutine chain(self, first, chain_of, number, values, branch)
      type(atlas_t), intent(in) :: self
      integer, intent(in) :: first, number
      integer, intent(inout) :: chain_of(:)
      real(wp), intent(in) :: values(:)
      type(branch_t), intent(inout) :: branch

      type(point_t), allocatable :: point(:)
      integer :: at, begin, n, next(2)

      branch%periods = self%piece(first)%branch%periods
      branch%count = 0
      allocate (branch%point(0))
      at = first
      begin = merge(2, 1, self%piece(first)%end(1)%mate(1) > 0 .and. self%piece(first)%end(2)%mate(1) == 0)
      do
         chain_of(at) = number
         associate (piece => self%piece(at))
            n = piece%branch%count
            point = piece%branch%point(:n)
            if (begin == 2) point = point(n:1:-1)
            if (branch%count > 0) then
               ! The end of one piece and the beginning of the next are one motion.
               associate (joint => branch%point(branch%count))
                  joint%label = ""
                  if (any(abs(joint%orbit%u(size(joint%orbit%u)) - values) <= same_value)) joint%label = "UZ"
               end associate
               point = point(2:)
            end if
            branch%point = [branch%point, point]
            branch%count = size(branch%point)
            branch%unexplained = branch%unexplained + piece%branch%unexplained
            branch%ending = ""
            if (begin == 1) branch%ending = piece%branch%ending
            next = piece%end(3 - begin)%mate
         end associate
         if (next(1) == 0) exit
         if (chain_of(next(1)) > 0) then
            branch%ending = "it is closed"
            return
         end if
         at = next(1)
         begin = next(2)
      end do
      if (begin == 1 .or. branch%point(branch%count)%label /= "") return
      branch%point(branch%count)%label = merge("EP", "MX", self%piece(at)%parent > 0)
      if (self%piece(at)%parent > 0) branch%ending = "where it begins on another branch"
   end subroutine chain

end module razy_study_follow_atlas
